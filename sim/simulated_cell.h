// The simulated cell as a whole: the scene, its pictures, the cameras that serve them, and what may be done
// to it while it runs.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/cell.h"
#include "sim/gige_server.h"
#include "sim/renderer.h"
#include "sim/scene.h"
#include "sim/v4l2_server.h"

namespace zeropose {

// The pictures that the cameras see at the moment, without noise, and the noise of every frame.
class CellPictures {
 public:
  // One scene or more, of the same cameras; shows the first one's object at its nominal pose.
  explicit CellPictures(std::span<const Scene> scenes);

  // Renders all cameras side by side.
  void show(std::size_t scene, const Pose& X_WO, const Faults& faults,
            const std::optional<Carried>& carried = std::nullopt);
  // The frame that a camera takes now, from pixel `first` on; the noise of every call is new. One thread for
  // each camera at a time.
  void draw(std::size_t camera, std::span<std::uint8_t> pixels, std::size_t first = 0);

 private:
  using Clean = std::vector<float>;

  const double noise_sigma_grey_;
  std::vector<std::vector<CameraRenderer>> renderers_;  // by scene and camera
  std::vector<std::uint64_t> noise_states_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<const Clean>> clean_;
};

// Calls may come from several threads and throw std::invalid_argument for names that the cell does not know.
class SimulatedCell {
 public:
  // Shows the first job's object at its nominal pose. The cameras are served by GigE Vision, or by V4L2 when
  // those of the cell file are. Throws std::runtime_error when a camera cannot be served.
  SimulatedCell(const Cell& cell, std::vector<Scene> scenes);

  // X_WO. Frames exposed after the return show the object there; the same for all faults.
  void show(const Pose& X_WO);
  // The object of another job, and none else: two that one camera sees from two places of the hand.
  void show(std::size_t job, const Pose& X_WO);
  // Moves a robot's hand, and the cameras that it carries, to where it truly is.
  void move_hand(std::size_t robot, const Pose& X_RH);
  // All that covers marks or edges from now on.
  void cover(std::set<std::string> names);
  // Takes the object away and shows a target of a calibration instead.
  void show_target(const Carried& target);
  Pose pose() const;
  Faults faults() const;
  const Scene& scene() const { return scenes_[shown_]; }  // of the job whose object is shown
  bool camera_runs(const std::string& camera) const;

  void cover_mark(const std::string& mark);
  void displace_mark(const std::string& mark, double displacement_px);
  void move_camera(const std::string& camera, const Pose& X_CoCn);  // from where it truly is
  void stop_camera(const std::string& camera);
  void start_camera(const std::string& camera);
  void lose_packets(const std::string& camera, double ratio);  // of the stream, 0..1
  void clear_faults();                                         // also brings the cameras back

 private:
  GigeServer& gige(const char* fault);  // throws std::invalid_argument: V4L2 cameras have no such fault
  void require_mark(const std::string& mark) const;
  std::size_t index_of(const std::string& camera) const;
  void render();  // with mutex_ held
  std::optional<Carried> pane() const;

  const std::vector<Scene> scenes_;  // by job
  mutable std::mutex mutex_;
  std::atomic<std::size_t> shown_ = 0;
  Pose X_WO_;
  Faults faults_;
  std::optional<Carried> target_;      // of a calibration
  std::map<std::size_t, Pose> hands_;  // X_RH of the robots that were moved
  CellPictures pictures_;
  std::unique_ptr<GigeServer> gige_;  // one of the two
  std::unique_ptr<V4l2Server> v4l2_;
};

}  // namespace zeropose
