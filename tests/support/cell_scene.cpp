#include "tests/support/cell_scene.h"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "measure/mark_image.h"

namespace zeropose::test {
namespace {

using nlohmann::json;

Eigen::Vector3d vector_of(const json& numbers) {
  return {numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>()};
}

Mark mark_of(const json& entry) {
  Mark mark;
  mark.name = entry.at("name");
  mark.bright = entry.at("kind") == "bright_disc";
  mark.p_O_mm = vector_of(entry.at("position_mm"));
  mark.normal_O = vector_of(entry.at("normal")).normalized();
  mark.radius_mm = entry.at("radius_mm");
  mark.weight = entry.at("weight");
  mark.tolerance_px = entry.at("tolerance_px");
  return mark;
}

std::vector<CalibratedCamera> published_cameras() {
  const CsvTable internals("tests/golden/camera-in-body.csv"), poses("tests/golden/camera-in-world.csv");
  std::vector<CalibratedCamera> cameras;
  for (std::size_t i = 0; i < internals.size(); ++i) {
    CalibratedCamera& camera = cameras.emplace_back();
    camera.name = internals.text(i, "camera");
    camera.model = {768,
                    572,
                    internals.number(i, "fx_px"),
                    internals.number(i, "fy_px"),
                    internals.number(i, "cx_px"),
                    internals.number(i, "cy_px"),
                    Division{internals.number(i, "K")}};
    camera.X_WC = pose(poses, i);
  }
  return cameras;
}

void read_requirements(const json& entry, Job& job) {
  const json& needed = entry.at("requirements");
  job.requirements.min_marks = needed.at("min_marks");
  job.requirements.min_marks_per_camera = needed.at("min_marks_per_camera");
  job.requirements.min_cameras = needed.at("min_cameras");
  job.requirements.max_sigma_mm = needed.at("max_sigma_mm");
  job.requirements.max_hidden_mm = needed.at("max_hidden_mm");
  job.requirements.max_compensation_mm = needed.at("max_compensation_mm");
  const char* const keys[] = {"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"};
  for (std::size_t i = 0; i < 6; ++i) {
    const json& range = entry.at("limits").at(keys[i]);
    job.requirements.limits[i] = {range.at(0).get<double>(), range.at(1).get<double>()};
  }
}

Job job_of(const json& entry, const std::vector<CalibratedCamera>& cameras) {
  Job job;
  job.name = entry.at("name");
  job.number = entry.at("number");
  job.search_mm = entry.at("search_mm");
  job.system_sigma_px = entry.at("system_sigma_px");
  for (const json& mark : entry.at("marks")) {
    for (std::size_t camera = 0; camera < cameras.size(); ++camera)
      for (const json& name : mark.at("cameras"))
        if (name == cameras[camera].name) job.views.push_back({camera, job.marks.size()});
    job.marks.push_back(mark_of(mark));
  }
  for (const json& point : entry.at("application_points"))
    job.application_points.push_back({point.at("name"), vector_of(point.at("position_mm"))});
  read_requirements(entry, job);
  return job;
}

}  // namespace

CellScene car_body() {
  const std::string path = std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/car-body.json";
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  const json cell = json::parse(file, nullptr, true, true);
  CellScene scene;
  scene.cameras = published_cameras();
  scene.job = job_of(cell.at("jobs").at(0), scene.cameras);
  return scene;
}

std::vector<Observation> observe(std::span<const CalibratedCamera> cameras, const Job& job, const Pose& X_WO,
                                 double sigma_px, Random& random) {
  std::vector<Observation> observations;
  for (const View& view : job.views) {
    const CalibratedCamera& camera = cameras[view.camera];
    const Mark& mark = job.marks[view.mark];
    const Pose X_CO = camera.X_WC.inverse() * X_WO;
    const auto u = project(camera.model, X_CO * mark.p_O_mm);
    const Eigen::Vector2d noise(normal(random, sigma_px), normal(random, sigma_px));
    if (!u) continue;
    const Eigen::Vector2d offset =
        has_image_offset(mark)
            ? image_offset(camera.model, mark, X_CO * mark.p_O_mm, X_CO.linear() * mark.normal_O, 1)
            : Eigen::Vector2d(0, 0);
    const double variance = sigma_px > 0 ? sigma_px * sigma_px : 1e-4;
    observations.push_back(
        {view.camera, view.mark, *u + offset + noise, variance * Eigen::Matrix2d::Identity()});
  }
  return observations;
}

Pose random_shift(Random& random, double mm, double deg) {
  const Eigen::Vector3d p = uniform_vector(random, mm), r = uniform_vector(random, deg);
  return from_six_numbers({p.x(), p.y(), p.z(), r.x(), r.y(), r.z()});
}

PoseProblem problem_of(std::span<const CalibratedCamera> cameras, const Job& job,
                       std::span<const Observation> observations, const Pose& X_WO_start) {
  PoseProblem problem;
  problem.cameras = cameras;
  problem.marks = job.marks;
  problem.observations = observations;
  problem.X_WO_start = X_WO_start;
  problem.system_sigma_px = job.system_sigma_px;
  return problem;
}

CellScene car_body_points() {
  CellScene scene = car_body();
  scene.job.system_sigma_px = 0;
  for (Mark& mark : scene.job.marks) {
    mark.radius_mm = 0;
    mark.weight = 1;
    mark.tolerance_px = no_tolerance;
  }
  return scene;
}

PoseResult estimate(const CellScene& scene, std::span<const Observation> observations,
                    std::optional<Pose> X_WO_start) {
  PoseProblem problem = problem_of(scene.cameras, scene.job, observations, Pose::Identity());
  problem.X_WO_start = X_WO_start;
  return estimate_pose(problem);
}

void ErrorStatistics::add(const Pose& X_O0O, const Pose& X_O0O_true) {
  const SixNumbers a = to_six_numbers(X_O0O), b = to_six_numbers(X_O0O_true);
  Vector6 error;
  error << a.x_mm - b.x_mm, a.y_mm - b.y_mm, a.z_mm - b.z_mm, a.rx_deg - b.rx_deg, a.ry_deg - b.ry_deg,
      a.rz_deg - b.rz_deg;
  ++count_;
  squares_ += error.cwiseAbs2();
  largest_ = largest_.cwiseMax(error.cwiseAbs());
}

void ErrorStatistics::print(const char* title) const {
  const Vector6 r = rms(), m = largest_;
  std::printf(
      "%-46s n %5d  rms %.4f %.4f %.4f mm %.5f %.5f %.5f deg\n%-56s max %.4f %.4f %.4f mm %.5f %.5f %.5f "
      "deg\n",
      title, count_, r(0), r(1), r(2), r(3), r(4), r(5), "", m(0), m(1), m(2), m(3), m(4), m(5));
}

}  // namespace zeropose::test
