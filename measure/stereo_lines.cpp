#include "measure/stereo_lines.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace zeropose {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double most_gap_px = 2.5;  // between neighbouring centres of the right line

Vector2d pixel_of(const LightLine& line, const LineCentre& centre, double off_px = 0) {
  const double place = centre.place + off_px;
  return line.course == LineCourse::upright ? Vector2d(place, centre.at) : Vector2d(centre.at, place);
}

// Two rays that lie in one plane, from o1 along d1 and from o2 along d2. Nothing behind a camera.
std::optional<Vector3d> meeting(const Vector3d& o1, const Vector3d& d1, const Vector3d& o2,
                                const Vector3d& d2) {
  const Vector3d b = o2 - o1;
  const double dd = d1.dot(d2), a = d1.squaredNorm(), c = d2.squaredNorm(), det = a * c - dd * dd;
  if (!(det > 1e-9 * a * c)) return std::nullopt;
  const double first = (c * b.dot(d1) - dd * b.dot(d2)) / det;
  const double second = (dd * b.dot(d1) - a * b.dot(d2)) / det;
  if (!(first > 0 && second > 0)) return std::nullopt;
  return o1 + first * d1;
}

// The right line as rays in W, as found and moved by one sigma across.
class RightLine {
 public:
  RightLine(const CalibratedCamera& camera, const LightLine& line) : origin_W_(camera.X_WC.translation()) {
    for (const LineCentre& centre : line.centres) {
      const auto d = ray(camera.model, pixel_of(line, centre));
      const auto moved = ray(camera.model, pixel_of(line, centre, centre.sigma_px));
      if (!d || !moved) continue;
      rays_.push_back({centre.at, camera.X_WC.linear() * *d, camera.X_WC.linear() * *moved});
    }
  }

  const Vector3d& origin_W() const { return origin_W_; }

  // Between which centres the plane with this normal through the camera cuts the line: the first of both.
  std::optional<std::size_t> cut(const Vector3d& normal) const {
    std::optional<std::size_t> found;
    for (std::size_t j = 0; j + 1 < rays_.size(); ++j) {
      if ((normal.dot(rays_[j].d_W) < 0) == (normal.dot(rays_[j + 1].d_W) < 0)) continue;
      if (found || rays_[j + 1].at - rays_[j].at > most_gap_px) return std::nullopt;
      found = j;
    }
    return found;
  }

  Vector3d ray_at(std::size_t j, const Vector3d& normal, bool moved) const {
    const Vector3d &a = moved ? rays_[j].moved_W : rays_[j].d_W,
                   &b = moved ? rays_[j + 1].moved_W : rays_[j + 1].d_W;
    const double at_a = normal.dot(a), at_b = normal.dot(b);
    return a + at_a / (at_a - at_b) * (b - a);
  }

 private:
  struct Ray {
    double at;
    Vector3d d_W, moved_W;
  };
  Vector3d origin_W_;
  std::vector<Ray> rays_;
};

class Sensor {
 public:
  Sensor(const CalibratedCamera& left, const RightLine& line)
      : left_(left), line_(line), base_W_(line.origin_W() - left.X_WC.translation()) {}

  std::optional<SidePoint> point(const Vector2d& u_px, const Vector2d& moved_px) const {
    const auto d = ray(left_.model, u_px), moved = ray(left_.model, moved_px);
    if (!d || !moved) return std::nullopt;
    const Vector3d d_W = left_.X_WC.linear() * *d, moved_W = left_.X_WC.linear() * *moved;
    const auto j = line_.cut(base_W_.cross(d_W));
    if (!j) return std::nullopt;
    const auto p = meet(d_W, *j, false), by_left = meet(moved_W, *j, false), by_right = meet(d_W, *j, true);
    if (!p || !by_left || !by_right) return std::nullopt;
    return SidePoint{*p, *by_left - *p, *by_right - *p};
  }

 private:
  std::optional<Vector3d> meet(const Vector3d& d_W, std::size_t j, bool right_moved) const {
    return meeting(left_.X_WC.translation(), d_W, line_.origin_W(),
                   line_.ray_at(j, base_W_.cross(d_W), right_moved));
  }

  const CalibratedCamera& left_;
  const RightLine& line_;
  Vector3d base_W_;
};

}  // namespace

SideLine points_on_line(const CalibratedCamera& left, const LightLine& left_line,
                        const CalibratedCamera& right, const LightLine& right_line) {
  const RightLine line(right, right_line);
  const Sensor sensor(left, line);
  SideLine points;
  for (const LineCentre& centre : left_line.centres) {
    const auto point =
        sensor.point(pixel_of(left_line, centre), pixel_of(left_line, centre, centre.sigma_px));
    if (point) points.push_back(*point);
  }
  return points;
}

}  // namespace zeropose
