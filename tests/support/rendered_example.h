// A shipped example cell from rendered pictures to measurements, without network in between.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "config/cell.h"
#include "tests/support/poses.h"
#include "tests/support/rendered_pictures.h"

namespace zeropose::test {

class RenderedExample {
 public:
  // drawing_sigma_mm: how far each coordinate of a mark's true place is off the job's.
  explicit RenderedExample(const std::string& name, double drawing_sigma_mm = 0)
      : cell_(load_cell(file(name, ".json"))),
        scene_(off_the_drawing(load_scene(cell_, file(name, ".sim.json")), drawing_sigma_mm)),
        renderer_(scene_) {}

  const Job& job() const { return cell_.jobs.front(); }
  const Scene& scene() const { return scene_; }
  const std::vector<CalibratedCamera>& believed() const { return cell_.calibration; }
  const References& references() const { return cell_.references; }
  Pose zero_pose() const { return job().X_WO_nominal; }

  std::vector<CleanPicture> clean(const Pose& X_WO, const Faults& faults = {}) const {
    return renderer_.clean(X_WO, faults);
  }
  // One exposure; the noise of every one is new.
  Exposed exposed(const std::vector<CleanPicture>& clean) {
    return {scene_.cameras, clean, scene_.picture.noise_sigma_grey, noise_state_};
  }

  ZeroResult zero(std::span<const CalibratedCamera> believed) {
    const auto pictures = clean(zero_pose());
    std::vector<std::vector<Observation>> frames;
    std::vector<std::vector<MarkFinding>> references;
    for (int i = 0; i < cell_.zero_frames; ++i) {
      Exposed frame = exposed(pictures);
      frames.push_back(observations_of(find_job_marks(frame.images(), job(), believed, zero_pose()), job()));
      references.push_back(find_references(frame.images(), cell_.references, believed));
    }
    ZeroResult result = make_zero(believed, job(), frames);
    result.zero.references = average_references(cell_.references, believed, references).references;
    return result;
  }

  // Of the object at X_O0O from its zero, with the calibration that the cell ships.
  Measurement measured(const Zero& zero, const Pose& X_O0O, const Faults& faults = {}) {
    Exposed frame = exposed(clean(zero_pose() * X_O0O, faults));
    return measure({frame.images(), job(), believed(), zero});
  }

 private:
  static std::string file(const std::string& name, const char* ending) {
    return std::string(ZEROPOSE_SOURCE_DIR) + "/config/cells/" + name + ending;
  }

  static Scene off_the_drawing(Scene scene, double sigma_mm) {
    Random random(1);
    for (Mark& mark : scene.marks)
      for (double& coordinate : mark.p_O_mm) coordinate += normal(random, sigma_mm);
    return scene;
  }

  Cell cell_;
  Scene scene_;
  SceneRenderer renderer_;
  std::uint64_t noise_state_ = 1;
};

// The marks that a measurement threw out as wrong.
inline std::vector<std::string> removed_marks(const Measurement& measurement, const Job& job) {
  std::vector<std::string> names;
  for (const std::size_t i : measurement.pose.removed)
    names.push_back(job.marks[measurement.observations[i].mark].name);
  return names;
}

// How far an application point of the job is misplaced at most.
inline double worst_point_mm(const Job& job, const Pose& X_O0O, const Pose& X_O0O_true) {
  double worst = 0;
  for (const ApplicationPoint& point : job.application_points)
    worst = std::max(worst, (X_O0O * point.p_O_mm - X_O0O_true * point.p_O_mm).norm());
  return worst;
}

}  // namespace zeropose::test
