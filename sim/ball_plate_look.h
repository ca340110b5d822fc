// A plate lit from behind with dark balls before it.
#pragma once

#include "sim/look.h"

namespace zeropose {

// The circle on which a camera's lines of sight touch a ball: what is seen of the ball's outline is that of
// this flat disc. p_C: the ball's centre in the camera, farther away than the radius.
struct TangentDisc {
  Pose X_CM = Pose::Identity();  // in z = 0 of M, about its origin
  double radius_mm = 0;
};
TangentDisc tangent_disc(const Eigen::Vector3d& p_C_mm, double radius_mm);

// A ball of one grey, if it is before the camera.
void paint_ball(Canvas& canvas, const Eigen::Vector3d& p_C_mm, double radius_mm, double grey);

class BallPlateLook final : public Look {
 public:
  // Throws std::invalid_argument for marks that are no balls of known radius.
  BallPlateLook(const BallPlateObject& plate, const Scene& scene, std::size_t camera);
  void paint(Canvas& canvas, const Moment& moment) const override;
  Illumination light() const override { return light_; }

 private:
  struct Ball {
    std::string name;
    Eigen::Vector3d p_O_mm = Eigen::Vector3d::Zero();
    double radius_mm = 0, grey = 0;
    std::vector<Thing> cover;
  };
  void paint_ball(Canvas& canvas, const Ball& ball, const Moment& moment) const;

  Illumination light_;
  Sheet plate_;
  std::vector<Ball> balls_;
};

}  // namespace zeropose
