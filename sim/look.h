// How a kind of object and what is round it look to one camera. Each kind is a class of its own; which one a
// cell shows is said in its truth file.
#pragma once

#include <cstddef>
#include <memory>

#include "sim/canvas.h"
#include "sim/scene.h"

namespace zeropose {

// Where everything is when a picture is taken. A camera that was moved, by accident or by a robot's hand, has
// left the place where the scene has it.
struct Moment {
  Pose X_CW = Pose::Identity(), X_CO = Pose::Identity();
  Pose X_CnCo = Pose::Identity();  // the camera's place in the scene, as seen from where it is now
  const Faults& faults;
  std::optional<Pose> X_CT{};  // of the pane that the hand carries

  bool covered(const std::string& mark) const { return faults.covered.contains(mark); }
  // A mark at X_CM, or displaced at the same distance if it has that fault.
  Pose placed(const std::string& mark, const CameraModel& camera, const Pose& X_CM) const;
};

class Look {
 public:
  virtual ~Look() = default;
  // Everything but the reference points, under even light. Pure; may be called from several threads.
  virtual void paint(Canvas& canvas, const Moment& moment) const = 0;
  virtual Illumination light() const = 0;
};

// That of the scene's object. Decides once, by the scene's seed and the camera's index, what stands and hangs
// around. Throws std::invalid_argument for marks that the object cannot have.
std::unique_ptr<const Look> make_look(const Scene& scene, std::size_t camera);

}  // namespace zeropose
