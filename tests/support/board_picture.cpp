#include "tests/support/board_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/eccentricity.h"

namespace zeropose::test {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int fine = 4;  // samples per pixel and axis

// Which share of a small square of unit size lies on the near side of an edge at this signed distance
// (negative: inside).
double covered(double distance) { return std::clamp(0.5 - distance, 0.0, 1.0); }

// Grey level of a small square on the plane at q; M: mm per side of the square.
class Plane {
 public:
  explicit Plane(const BoardScene& scene) : s_(scene) {
    const bool zigzag = s_.kind == BoardKind::asymmetric_circles;
    far_ = s_.pitch_mm * Vector2d(zigzag ? 2 * s_.cols - 1 : s_.cols - 1, s_.rows - 1);
    printed_.assign(std::size_t(s_.rows) * std::size_t(s_.cols), true);
    for (const BoardIndex& at : s_.unprinted) printed_[index(at.row, at.col)] = false;
  }

  double grey(const Vector2d& q, const Matrix2d& M) const {
    const double on_board =
        inside_rectangle(q, M, Vector2d::Constant(-s_.margin_mm), far_ + Vector2d::Constant(s_.margin_mm));
    double print = s_.kind == BoardKind::chessboard ? squares(q, M) : circle(q, M);
    for (const auto& spot : s_.spots) {
      const double near = spot.diameter_mm / 2 + s_.pitch_mm;
      if ((q - spot.centre_mm).squaredNorm() > near * near) continue;
      print = std::max(print, disc(q - spot.centre_mm, M, spot.diameter_mm));
    }
    const double ground = s_.surroundings + on_board * (s_.surface - s_.surroundings);
    return ground + print * (s_.print - ground);
  }

 private:
  std::size_t index(int row, int col) const {
    return std::size_t(row) * std::size_t(s_.cols) + std::size_t(col);
  }

  static double disc(const Vector2d& from_centre, const Matrix2d& M, double diameter) {
    const double length = from_centre.norm();
    if (length < 1e-9) return 1;
    const double slope = (M.transpose() * from_centre).norm() / length;
    return covered((length - diameter / 2) / slope);
  }
  static double inside_rectangle(const Vector2d& q, const Matrix2d& M, const Vector2d& low,
                                 const Vector2d& high) {
    double share = 1;
    for (int axis = 0; axis < 2; ++axis) {
      const double slope = M.row(axis).norm();
      share *= covered((low(axis) - q(axis)) / slope) * covered((q(axis) - high(axis)) / slope);
    }
    return share;
  }

  double circle(const Vector2d& q, const Matrix2d& M) const {
    const int row = static_cast<int>(std::lround(q.y() / s_.pitch_mm));
    const bool zigzag = s_.kind == BoardKind::asymmetric_circles;
    const double x = q.x() / s_.pitch_mm;
    const int col = static_cast<int>(zigzag ? std::lround((x - (row & 1)) / 2) : std::lround(x));
    if (row < 0 || col < 0 || row >= s_.rows || col >= s_.cols || !printed_[index(row, col)]) return 0;
    return disc(q - s_.p_B_mm({row, col}).head<2>(), M, s_.diameter_mm);
  }

  // Corners at whole pitches; the square beyond the corner (0, 0) is dark.
  double squares(const Vector2d& q, const Matrix2d& M) const {
    double product = 1;
    for (int axis = 0; axis < 2; ++axis) {
      const double place = q(axis) / s_.pitch_mm, line = std::round(place);
      const double side = std::clamp(2 * (place - line) * s_.pitch_mm / M.row(axis).norm(), -1.0, 1.0);
      product *= static_cast<long>(line) % 2 == 0 ? side : -side;
    }
    const Vector2d one = Vector2d::Constant(s_.pitch_mm);
    return inside_rectangle(q, M, -one, far_ + one) * (0.5 + 0.5 * product);
  }

  const BoardScene& s_;
  Vector2d far_;
  std::vector<bool> printed_;
};

// Where a ray meets the plane z = 0 of the board, mm.
struct Eye {
  Eigen::Matrix3d R_BC;
  Vector3d p_BC;

  Vector2d operator()(const Vector3d& ray_C) const {
    const Vector3d d = R_BC * ray_C;
    return (p_BC - d * (p_BC.z() / d.z())).head<2>();
  }
};

// Rays at the corners of all pixels.
std::vector<Vector3d> corner_rays(const CameraModel& camera) {
  std::vector<Vector3d> rays;
  for (int v = 0; v <= camera.height_px; ++v)
    for (int u = 0; u <= camera.width_px; ++u)
      rays.push_back(ray(camera, Vector2d(u - 0.5, v - 0.5)).value_or(Vector3d(0, 0, 1)));
  return rays;
}

// A picture at `fine` samples per pixel, made row by row of pixels.
class FineRows {
 public:
  FineRows(const BoardScene& scene)
      : s_(scene),
        plane_(scene),
        rays_(corner_rays(scene.camera)),
        eye_{scene.X_CB.linear().transpose(), scene.X_CB.inverse().translation()} {}

  // fine x (width * fine) grey levels of one row of pixels.
  void fill(int v, std::vector<double>& out) const {
    const int w = s_.camera.width_px, wide = w * fine;
    out.resize(std::size_t(wide) * fine);
    for (int u = 0; u < w; ++u) {
      const Vector3d &a = corner(u, v), &b = corner(u + 1, v), &c = corner(u, v + 1),
                     &d = corner(u + 1, v + 1);
      Matrix2d M;
      M << eye_(b) - eye_(a), eye_(c) - eye_(a);
      M /= fine;
      const bool flat = is_flat(u, v, M);
      for (int j = 0; j < fine; ++j) {
        for (int i = 0; i < fine; ++i) {
          double& grey = out[std::size_t(j) * std::size_t(wide) + std::size_t(u * fine + i)];
          if (flat && (i > 0 || j > 0)) {
            grey = out[std::size_t(u * fine)];
            continue;
          }
          const double x = (i + 0.5) / fine, y = (j + 0.5) / fine;
          const Vector3d along = (1 - y) * ((1 - x) * a + x * b) + y * ((1 - x) * c + x * d);
          grey = covered_grey(plane_.grey(eye_(along), M), Vector2d(u - 0.5 + x, v - 0.5 + y));
        }
      }
    }
  }

 private:
  const Vector3d& corner(int u, int v) const {
    return rays_[std::size_t(v) * std::size_t(s_.camera.width_px + 1) + std::size_t(u)];
  }
  // The same grey at the four corners and the middle seen with a square of twice the pixel's size.
  bool is_flat(int u, int v, const Matrix2d& M) const {
    if (!s_.covers.empty()) return false;
    const Matrix2d wide = 2.5 * fine * M;
    const Vector3d &a = corner(u, v), &b = corner(u + 1, v), &c = corner(u, v + 1), &d = corner(u + 1, v + 1);
    const double grey = plane_.grey(eye_(0.25 * (a + b + c + d)), wide);
    return plane_.grey(eye_(a), M) == grey && plane_.grey(eye_(b), M) == grey &&
           plane_.grey(eye_(c), M) == grey && plane_.grey(eye_(d), M) == grey;
  }
  double covered_grey(double grey, const Vector2d& u_px) const {
    for (const auto& cover : s_.covers) {
      double share = 1;
      for (std::size_t k = 0; k < cover.corners_px.size(); ++k) {
        const Vector2d from = cover.corners_px[k];
        const Vector2d along = (cover.corners_px[(k + 1) % cover.corners_px.size()] - from).normalized();
        const Vector2d off = u_px - from;
        share *= covered(-fine * (along.x() * off.y() - along.y() * off.x()));
      }
      grey += share * (cover.grey - grey);
    }
    return grey;
  }

  const BoardScene& s_;
  Plane plane_;
  std::vector<Vector3d> rays_;
  Eye eye_;
};

// Weights of the samples from -reach pixels to +reach pixels about a pixel's centre: Gauss over the pixel's
// width.
std::vector<double> kernel_of(double sigma, int reach) {
  std::vector<double> kernel;
  double sum = 0;
  for (int k = 0; k < (2 * reach + 1) * fine; ++k) {
    const double x = (k + 0.5) / fine - reach - 0.5;
    double weight = 0;
    for (int i = 0; i < 32; ++i) {
      const double t = (x - 0.5 + (i + 0.5) / 32) / sigma;
      weight += std::exp(-0.5 * t * t);
    }
    kernel.push_back(weight);
    sum += weight;
  }
  for (double& weight : kernel) weight /= sum;
  return kernel;
}

}  // namespace

Vector3d BoardScene::p_B_mm(const BoardIndex& at) const {
  const int x = kind == BoardKind::asymmetric_circles ? 2 * at.col + at.row % 2 : at.col;
  return {x * pitch_mm, at.row * pitch_mm, 0};
}

Vector2d BoardScene::centre_px(const BoardIndex& at) const {
  return project(camera, X_CB * p_B_mm(at)).value();
}

Vector2d BoardScene::seen_px(const BoardIndex& at) const {
  if (kind == BoardKind::chessboard) return centre_px(at);
  return centre_px(at) +
         ellipse_centre_offset(camera, X_CB * p_B_mm(at), X_CB.linear().col(2), diameter_mm / 2);
}

BoardProblem BoardScene::problem() const {
  BoardProblem problem;
  problem.kind = kind;
  problem.rows = rows;
  problem.cols = cols;
  problem.pitch_mm = pitch_mm;
  return problem;
}

Pose board_pose(const BoardScene& scene, double distance_mm, double tilt_rad, double axis_rad,
                double roll_rad) {
  const Vector3d axis(std::cos(axis_rad), std::sin(axis_rad), 0);
  Pose X_CB = Pose::Identity();
  X_CB.linear() =
      (Eigen::AngleAxisd(tilt_rad, axis) * Eigen::AngleAxisd(roll_rad, Vector3d::UnitZ())).matrix();
  const Vector3d middle = 0.5 * (scene.p_B_mm({0, 0}) + scene.p_B_mm({scene.rows - 1, scene.cols - 1}));
  X_CB.translation() = Vector3d(0, 0, distance_mm) - X_CB.linear() * middle;
  return X_CB;
}

Vector2d shading_of_ratio(const CameraModel& camera, double ratio) {
  const double most = (ratio - 1) / (ratio + 1);  // 1 - most at one corner, 1 + most at the other
  const Vector2d half(0.5 * camera.width_px, 0.5 * camera.height_px);
  return most * half / half.squaredNorm();
}

Picture paint(const BoardScene& scene) {
  const int w = scene.camera.width_px, h = scene.camera.height_px;
  const int reach = static_cast<int>(std::ceil(4 * scene.blur_sigma_px));
  const std::vector<double> kernel = kernel_of(scene.blur_sigma_px, reach);
  const FineRows rows(scene);
  std::vector<double> fine_row, line;
  Picture picture{w, h, std::vector<double>(std::size_t(w) * std::size_t(h), 0.0)};
  std::vector<double> weights(picture.grey.size() / std::size_t(w), 0.0);
  for (int v = 0; v < h; ++v) {
    rows.fill(v, fine_row);
    for (int j = 0; j < fine; ++j) {
      line.assign(std::size_t(w), 0.0);
      const double* from = fine_row.data() + std::ptrdiff_t{j} * w * fine;
      for (int u = 0; u < w; ++u) {
        double sum = 0;
        for (int k = 0; k < static_cast<int>(kernel.size()); ++k)
          sum += kernel[std::size_t(k)] * from[std::clamp((u - reach) * fine + k, 0, w * fine - 1)];
        line[std::size_t(u)] = sum;
      }
      for (int to = std::max(0, v - reach); to <= std::min(h - 1, v + reach); ++to) {
        const double weight = kernel[std::size_t((v - to + reach) * fine + j)];
        weights[std::size_t(to)] += weight;
        double* row = picture.grey.data() + std::ptrdiff_t{to} * w;
        for (int u = 0; u < w; ++u) row[u] += weight * line[std::size_t(u)];
      }
    }
  }
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      const Vector2d off(u - 0.5 * (w - 1), v - 0.5 * (h - 1));
      picture.grey[std::size_t(v) * std::size_t(w) + std::size_t(u)] *=
          (1 + scene.shading_per_px.dot(off)) / weights[std::size_t(v)];
    }
  }
  return picture;
}

}  // namespace zeropose::test
