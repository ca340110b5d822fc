// The exact picture of something flat: which share of each pixel it fills, through lens model, perspective,
// blur and pixel area.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "calib/camera_model.h"

namespace zeropose {

// A closed outline in the plane z = 0 of a frame M.
class FlatOutline {
 public:
  struct Edge {
    double distance_mm = 0;  // negative inside; changes by no more than the way gone
    Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  // unit, outward, where the edge is nearest
  };

  virtual ~FlatOutline() = default;
  virtual Edge edge_at(const Eigen::Vector2d& q_mm) const = 0;
};

class DiscOutline final : public FlatOutline {  // about M's origin
 public:
  explicit DiscOutline(double radius_mm) : radius_mm_(radius_mm) {}
  Edge edge_at(const Eigen::Vector2d& q_mm) const override;

 private:
  double radius_mm_;
};

struct RoundHole {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0;
};

// A simple polygon, its vertices against the clock as seen from +z, with holes that neither touch it nor each
// other.
class PolygonOutline final : public FlatOutline {
 public:
  PolygonOutline(const std::vector<Eigen::Vector2d>& vertices_mm, std::vector<RoundHole> holes);
  Edge edge_at(const Eigen::Vector2d& q_mm) const override;

 private:
  struct Side {
    Eigen::Vector2d from_mm, along;  // unit
    double length_mm;
  };
  Edge polygon_edge_at(const Eigen::Vector2d& q_mm) const;

  std::vector<Side> sides_;
  std::vector<RoundHole> holes_;
};

// Calls visit(pixel, share) for the pixels, counted row by row, of which more than nothing lies inside. Every
// sample (a sixteenth of a pixel) goes through ray() to the plane and gets the share of its square that lies
// inside the outline, seen as straight there, so that the edge is not quantised. Then come the Gaussian blur
// and the pixel's box at the sample resolution. The centre of gravity of a disc's shares is that of its
// projected outline within 1e-4 px.
using VisitPixel = std::function<void(std::size_t pixel, double share)>;
void cover(const CameraModel& camera, const Pose& X_CM, const FlatOutline& outline, double blur_sigma_px,
           const VisitPixel& visit);

}  // namespace zeropose
