#include "sim/simulated_cell.h"

#include <algorithm>
#include <future>
#include <stdexcept>
#include <utility>

namespace zeropose {
namespace {

std::vector<ServedCamera> served(const std::vector<CameraOptions>& cameras) {
  std::vector<ServedCamera> all;
  for (const CameraOptions& camera : cameras)
    all.push_back({camera.name, camera.gige.address, camera.width_px, camera.height_px});
  return all;
}

std::vector<V4l2Server::Served> served_by_v4l2(const std::vector<CameraOptions>& cameras) {
  std::vector<V4l2Server::Served> all;
  for (const CameraOptions& camera : cameras)
    all.push_back({camera.v4l2.device, camera.width_px, camera.height_px});
  return all;
}

}  // namespace

CellPictures::CellPictures(std::span<const Scene> scenes)
    : noise_sigma_grey_(scenes.front().picture.noise_sigma_grey), clean_(scenes.front().cameras.size()) {
  for (std::size_t i = 0; i < clean_.size(); ++i)
    noise_states_.push_back(scenes.front().picture.seed * 1000 + i);
  for (const Scene& scene : scenes) {
    auto& renderers = renderers_.emplace_back();
    for (std::size_t i = 0; i < clean_.size(); ++i) renderers.emplace_back(scene, i);
  }
  show(0, scenes.front().X_WO_nominal, {});
}

void CellPictures::show(std::size_t scene, const Pose& X_WO, const Faults& faults,
                        const std::optional<Carried>& carried) {
  std::vector<std::future<Clean>> under_way;
  for (const CameraRenderer& renderer : renderers_.at(scene))
    under_way.push_back(
        std::async(std::launch::async, [&] { return renderer.clean_picture(X_WO, faults, carried); }));
  std::vector<std::shared_ptr<const Clean>> fresh;
  for (auto& picture : under_way) fresh.push_back(std::make_shared<const Clean>(picture.get()));
  const std::lock_guard lock(mutex_);
  clean_ = std::move(fresh);
}

void CellPictures::draw(std::size_t camera, std::span<std::uint8_t> pixels, std::size_t first) {
  std::shared_ptr<const Clean> clean;
  {
    const std::lock_guard lock(mutex_);
    clean = clean_[camera];
  }
  add_noise(std::span(*clean).subspan(first, pixels.size()), noise_sigma_grey_, noise_states_[camera],
            pixels);
}

SimulatedCell::SimulatedCell(const Cell& cell, std::vector<Scene> scenes)
    : scenes_(std::move(scenes)), X_WO_(scenes_.front().X_WO_nominal), pictures_(scenes_) {
  const auto draw = [this](std::size_t camera, std::span<std::uint8_t> pixels, std::size_t first = 0) {
    pictures_.draw(camera, pixels, first);
  };
  const auto driven_by = [&](CameraDriver driver) {
    return std::ranges::all_of(cell.cameras, [&](const auto& camera) { return camera.driver == driver; });
  };
  if (driven_by(CameraDriver::gige))
    gige_ = std::make_unique<GigeServer>(served(cell.cameras), draw);
  else if (driven_by(CameraDriver::v4l2))
    v4l2_ = std::make_unique<V4l2Server>(served_by_v4l2(cell.cameras), draw);
  else
    throw std::runtime_error("the simulated cell serves cameras that are all of driver gige or all of v4l2");
  if (const auto* gaps = std::get_if<GapsObject>(&scene().object)) move_hand(gaps->robot, gaps->X_RH);
}

GigeServer& SimulatedCell::gige(const char* fault) {
  if (!gige_) throw std::invalid_argument(std::string(fault) + " is for GigE Vision cameras only");
  return *gige_;
}

// A camera on a hand that was moved has moved in the hand.
void SimulatedCell::render() {
  Faults now = faults_;
  for (const HandCamera& carried : scene().hand_cameras) {
    const auto hand = hands_.find(carried.robot);
    if (hand == hands_.end()) continue;
    const CalibratedCamera& camera = scene().cameras[carried.camera];
    const Pose X_CoCn = camera.X_WC.inverse() * carried.X_WR * hand->second * carried.X_HC;
    const auto moved = faults_.moved_cameras.find(camera.name);
    now.moved_cameras[camera.name] = moved == faults_.moved_cameras.end() ? X_CoCn : X_CoCn * moved->second;
  }
  pictures_.show(shown_, X_WO_, now, target_ ? target_ : pane());
  if (gige_) gige_->picture_changed();
  if (v4l2_) v4l2_->picture_changed();
}

void SimulatedCell::show(const Pose& X_WO) { show(shown_, X_WO); }

void SimulatedCell::show(std::size_t job, const Pose& X_WO) {
  const std::lock_guard lock(mutex_);
  shown_ = job;
  X_WO_ = X_WO;
  target_.reset();
  render();
}

void SimulatedCell::move_hand(std::size_t robot, const Pose& X_RH) {
  const std::lock_guard lock(mutex_);
  hands_[robot] = X_RH;
  render();
}

void SimulatedCell::cover(std::set<std::string> names) {
  for (const std::string& name : names) require_mark(name);
  const std::lock_guard lock(mutex_);
  faults_.covered = std::move(names);
  render();
}

// The pane that a hand holds before a window opening.
std::optional<Carried> SimulatedCell::pane() const {
  const auto* gaps = std::get_if<GapsObject>(&scene().object);
  if (gaps == nullptr) return std::nullopt;
  const auto hand = hands_.find(gaps->robot);
  return CarriedPane{gaps->X_WR * (hand == hands_.end() ? gaps->X_RH : hand->second) * gaps->X_HT};
}

void SimulatedCell::show_target(const Carried& target) {
  constexpr double out_of_sight_mm = 1e6;
  const std::lock_guard lock(mutex_);
  X_WO_.translation().x() = out_of_sight_mm;
  target_ = target;
  render();
}

Pose SimulatedCell::pose() const {
  const std::lock_guard lock(mutex_);
  return X_WO_;
}

Faults SimulatedCell::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

void SimulatedCell::require_mark(const std::string& mark) const {
  const auto has = [&](const std::vector<Mark>& marks) {
    return std::ranges::find(marks, mark, &Mark::name) != marks.end();
  };
  const auto knows = [&](const Scene& scene) {
    const auto* gaps = std::get_if<GapsObject>(&scene.object);
    const auto* wheel = std::get_if<WheelObject>(&scene.object);
    return has(scene.marks) || has(scene.fixed_marks) || (gaps != nullptr && gap_spot(*gaps, mark)) ||
           (wheel != nullptr && wheel_fault(*wheel, mark));
  };
  if (std::ranges::none_of(scenes_, knows)) throw std::invalid_argument("no mark '" + mark + "' in the cell");
}

std::size_t SimulatedCell::index_of(const std::string& camera) const {
  const auto& cameras = scenes_.front().cameras;
  const auto found = std::ranges::find(cameras, camera, &CalibratedCamera::name);
  if (found == cameras.end()) throw std::invalid_argument("no camera '" + camera + "' in the cell");
  return static_cast<std::size_t>(found - cameras.begin());
}

bool SimulatedCell::camera_runs(const std::string& camera) const {
  const std::size_t index = index_of(camera);
  return !gige_ || gige_->running(index);
}

void SimulatedCell::cover_mark(const std::string& mark) {
  require_mark(mark);
  const std::lock_guard lock(mutex_);
  faults_.covered.insert(mark);
  render();
}

void SimulatedCell::displace_mark(const std::string& mark, double displacement_px) {
  require_mark(mark);
  const std::lock_guard lock(mutex_);
  faults_.displaced_px[mark] = displacement_px;
  render();
}

void SimulatedCell::move_camera(const std::string& camera, const Pose& X_CoCn) {
  index_of(camera);  // throws where there is none
  const std::lock_guard lock(mutex_);
  faults_.moved_cameras[camera] = X_CoCn;
  render();
}

void SimulatedCell::stop_camera(const std::string& camera) {
  gige("stopping a camera").stop_camera(index_of(camera));
}

void SimulatedCell::start_camera(const std::string& camera) {
  gige("starting a camera").start_camera(index_of(camera));
}

void SimulatedCell::lose_packets(const std::string& camera, double ratio) {
  if (!(ratio >= 0 && ratio <= 1)) throw std::invalid_argument("ratio must lie in 0..1");
  gige("losing packets").lose_packets(index_of(camera), ratio);
}

void SimulatedCell::clear_faults() {
  for (std::size_t i = 0; gige_ && i < scenes_.front().cameras.size(); ++i) {
    gige_->start_camera(i);
    gige_->lose_packets(i, 0);
  }
  const std::lock_guard lock(mutex_);
  faults_ = {};
  render();
}

}  // namespace zeropose
