#include "sim/coverage.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/plane_view.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int samples_per_px = 4;
constexpr int tile_px = 16;

// Where a point of the image lies against the outline, seen as straight there.
struct EdgePoint {
  double distance_px = 0;              // negative inside
  Vector2d normal = Vector2d::Zero();  // unit, outward
};

// Weights of the samples for one pixel: Gaussian by the box of a pixel, symmetric, sum 1.
std::vector<double> pixel_kernel(double blur_sigma_px) {
  const double sigma = blur_sigma_px * samples_per_px;
  const int reach = static_cast<int>(std::ceil(5 * sigma));
  std::vector<double> kernel(static_cast<std::size_t>(2 * reach + samples_per_px), 0.0);
  double sum = 0;
  for (int offset = -reach; offset <= reach; ++offset) {
    const double weight = sigma > 0 ? std::exp(-0.5 * offset * offset / (sigma * sigma)) : 1;
    for (int s = 0; s < samples_per_px; ++s) kernel[static_cast<std::size_t>(offset + reach + s)] += weight;
    sum += samples_per_px * weight;
  }
  for (double& weight : kernel) weight /= sum;
  return kernel;
}

// An upright block of pixels and the samples it needs round it.
struct Tile {
  int u0 = 0, v0 = 0, width = 0, height = 0;  // px
  int guard = 0;                              // samples on each side
  double u(int column) const { return u0 - 0.5 + (column - guard + 0.5) / samples_per_px; }
  double v(int row) const { return v0 - 0.5 + (row - guard + 0.5) / samples_per_px; }
  int columns() const { return width * samples_per_px + 2 * guard; }
  int rows() const { return height * samples_per_px + 2 * guard; }
  Vector2d middle_px() const { return {u0 + (width - 1) / 2.0, v0 + (height - 1) / 2.0}; }
  // From the middle to the farthest sample.
  double reach_px() const { return std::hypot(width, height) / 2 + 1.5 * guard / samples_per_px; }
};

// The part of a sample's square inside the outline, exact for a straight edge.
double share_inside(const EdgePoint& edge) {
  const double inside = -edge.distance_px * samples_per_px;
  const double wide = edge.normal.cwiseAbs().maxCoeff(), narrow = edge.normal.cwiseAbs().minCoeff();
  const double missing = (wide + narrow) / 2 - std::abs(inside);  // to the square's last corner
  if (missing <= 0) return inside > 0 ? 1 : 0;
  if (missing >= narrow) return 0.5 + inside / wide;
  const double corner = missing * missing / (2 * wide * narrow);
  return inside > 0 ? 1 - corner : corner;
}

// The larger singular value.
double largest_stretch(const Matrix2d& M) {
  const double sum = M.squaredNorm() / 2, determinant = M.determinant();
  return std::sqrt(sum + std::sqrt(std::max(0.0, sum * sum - determinant * determinant)));
}

// An outline as the camera sees it in one tile, where the plane's scale hardly changes.
class OutlineInTile {
 public:
  enum class Lies { outside, across, inside };

  OutlineInTile(const PlaneView& plane, const FlatOutline& outline, const Tile& tile)
      : plane_(plane), outline_(outline) {
    const auto q = plane.meet(tile.middle_px());
    const auto px_per_mm = q ? plane.px_per_mm(*q) : std::nullopt;
    if (!px_per_mm) return;  // nothing of the plane is here
    const Matrix2d mm_per_px = px_per_mm->inverse();
    mm_per_px_transposed_ = mm_per_px.transpose();
    constexpr double perspective = 1.1;  // the far end of the tile has more mm per px
    mm_per_sample_ = perspective * largest_stretch(mm_per_px) / samples_per_px;
    const double distance = outline.edge_at(*q).distance_mm;
    const double reach_mm = mm_per_sample_ * samples_per_px * tile.reach_px();
    lies_ = distance > reach_mm ? Lies::outside : distance < -reach_mm ? Lies::inside : Lies::across;
  }

  Lies lies() const { return lies_; }

  // Of a sample, and how many of its neighbours on any side have the same at least.
  struct Share {
    double share = 0;
    int steps = 0;
  };
  Share share_at(const Vector2d& u_px) const {
    const auto q = plane_.meet(u_px);
    if (!q) return {};
    const FlatOutline::Edge edge = outline_.edge_at(*q);
    const Vector2d gradient = mm_per_px_transposed_ * edge.normal;
    const double slope = gradient.norm();
    const double steps = std::abs(edge.distance_mm) / mm_per_sample_ - 1;  // less the sample's own size
    return {share_inside({edge.distance_mm / slope, gradient / slope}),
            static_cast<int>(std::clamp(steps, 0.0, 1e4))};
  }

 private:
  const PlaneView& plane_;
  const FlatOutline& outline_;
  Matrix2d mm_per_px_transposed_ = Matrix2d::Identity();
  double mm_per_sample_ = 0;  // at most
  Lies lies_ = Lies::outside;
};

// One value per pixel across, one row per row of samples: already blurred along the rows.
std::vector<double> blurred_rows(const Tile& tile, const OutlineInTile& outline,
                                 const std::vector<double>& kernel) {
  std::vector<double> rows, samples(static_cast<std::size_t>(tile.columns()));
  rows.reserve(static_cast<std::size_t>(tile.rows() * tile.width));
  for (int row = 0; row < tile.rows(); ++row) {
    for (int column = 0; column < tile.columns();) {
      const auto [share, steps] = outline.share_at({tile.u(column), tile.v(row)});
      const int next = std::min(column + 1 + steps, tile.columns());
      std::fill(samples.begin() + column, samples.begin() + next, share);
      column = next;
    }
    for (int pixel = 0; pixel < tile.width; ++pixel) {
      const double* first = samples.data() + pixel * samples_per_px;
      double sum = 0;
      for (std::size_t tap = 0; tap < kernel.size(); ++tap) sum += kernel[tap] * first[tap];
      rows.push_back(sum);
    }
  }
  return rows;
}

// Calls put(u, v, share) for every pixel of the tile.
template <typename Put>
void cover_tile(const Tile& tile, const OutlineInTile& outline, const std::vector<double>& kernel, Put put) {
  const std::vector<double> rows = blurred_rows(tile, outline, kernel);
  for (int v = 0; v < tile.height; ++v) {
    for (int u = 0; u < tile.width; ++u) {
      const double* first = rows.data() + static_cast<std::ptrdiff_t>(v) * samples_per_px * tile.width + u;
      double sum = 0;
      for (std::size_t tap = 0; tap < kernel.size(); ++tap)
        sum += kernel[tap] * first[static_cast<std::ptrdiff_t>(tap) * tile.width];
      put(u, v, sum);
    }
  }
}

}  // namespace

FlatOutline::Edge DiscOutline::edge_at(const Vector2d& q_mm) const {
  const double r = q_mm.norm();
  if (!(r > 0)) return {-radius_mm_, Vector2d::UnitX()};
  return {r - radius_mm_, q_mm / r};
}

PolygonOutline::PolygonOutline(const std::vector<Vector2d>& vertices_mm, std::vector<RoundHole> holes)
    : holes_(std::move(holes)) {
  for (std::size_t i = 0; i < vertices_mm.size(); ++i) {
    const Vector2d along = vertices_mm[(i + 1) % vertices_mm.size()] - vertices_mm[i];
    sides_.push_back({vertices_mm[i], along.normalized(), along.norm()});
  }
}

// Inside are the points from which a line crosses the outline an odd number of times.
FlatOutline::Edge PolygonOutline::polygon_edge_at(const Vector2d& q_mm) const {
  double least = std::numeric_limits<double>::infinity();
  Vector2d away = Vector2d::UnitX(), along = Vector2d::UnitX();
  bool inside = false;
  for (const Side& side : sides_) {
    const Vector2d to = q_mm - side.from_mm;
    const double there = side.along.dot(to);
    const Vector2d from_side = to - std::clamp(there, 0.0, side.length_mm) * side.along;
    if (from_side.squaredNorm() < least) {
      least = from_side.squaredNorm();
      away = from_side;
      along = side.along;
    }
    const double rise = side.length_mm * side.along.y();
    if ((to.y() < 0) == (to.y() < rise)) continue;
    const double right = to.x() * side.along.y() - to.y() * side.along.x();  // of the side's line, upward
    if ((right < 0) == (rise > 0)) inside = !inside;
  }
  const double distance = std::sqrt(least), sign = inside ? -1 : 1;
  return {sign * distance,
          distance > 1e-9 ? Vector2d(sign / distance * away) : Vector2d(along.y(), -along.x())};
}

FlatOutline::Edge PolygonOutline::edge_at(const Vector2d& q_mm) const {
  Edge edge = polygon_edge_at(q_mm);
  for (const RoundHole& hole : holes_) {
    const Vector2d from_centre = q_mm - hole.centre_mm;
    const double r = from_centre.norm();
    if (hole.radius_mm - r < edge.distance_mm || !(r > 0)) continue;
    edge = {hole.radius_mm - r, -from_centre / r};
  }
  return edge;
}

void cover(const CameraModel& camera, const Pose& X_CM, const FlatOutline& outline, double blur_sigma_px,
           const VisitPixel& visit) {
  const PlaneView plane(camera, X_CM);
  const std::vector<double> kernel = pixel_kernel(blur_sigma_px);
  const int guard = (static_cast<int>(kernel.size()) - samples_per_px) / 2;
  for (int v0 = 0; v0 < camera.height_px; v0 += tile_px) {
    for (int u0 = 0; u0 < camera.width_px; u0 += tile_px) {
      const Tile tile{u0, v0, std::min(tile_px, camera.width_px - u0),
                      std::min(tile_px, camera.height_px - v0), guard};
      const auto put = [&](int u, int v, double share) {
        if (share <= 0) return;
        visit(static_cast<std::size_t>(v0 + v) * static_cast<std::size_t>(camera.width_px) +
                  static_cast<std::size_t>(u0 + u),
              share);
      };
      const OutlineInTile in_tile(plane, outline, tile);
      if (in_tile.lies() == OutlineInTile::Lies::across) cover_tile(tile, in_tile, kernel, put);
      if (in_tile.lies() != OutlineInTile::Lies::inside) continue;
      for (int v = 0; v < tile.height; ++v)
        for (int u = 0; u < tile.width; ++u) put(u, v, 1);
    }
  }
}

}  // namespace zeropose
