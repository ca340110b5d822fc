#include "measure/ellipse_band.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace zeropose {
namespace {

constexpr double outer_step_px = 1.5, inner_step_px = 2.25;
constexpr std::size_t bounds = 7;  // outlines between the classes of pixels, from the outside in
constexpr std::size_t edge_class = 3;

// The outline moved by an offset along its half axes; none if nothing is left. Row y (from the centre) of it
// reaches from -lean y - sqrt(middle2 - fall y^2) to -lean y + sqrt(..).
struct Bound {
  double lean = 0, middle2 = -1, fall = 0, reach_v = 0;
};

Bound bound_at(const HalfAxes& axes, double offset) {
  const double a = axes.major_px + offset, b = axes.minor_px + offset;
  if (b < 0.5) return {};
  const double c = std::cos(axes.angle_rad), s = std::sin(axes.angle_rad);
  const double ia = 1 / (a * a), ib = 1 / (b * b);
  const double A = c * c * ia + s * s * ib, B = c * s * (ia - ib);
  return {B / A, 1 / A, ia * ib / (A * A), std::sqrt(a * a * s * s + b * b * c * c)};
}

struct Columns {
  int from = 0, to = -1;  // inclusive; empty when to < from
};

int floor_of(double x) {
  const int i = static_cast<int>(x);
  return i > x ? i - 1 : i;
}

// Pixels of row y inside the bound; empty spans stay inside the parent so that classes remain nested.
Columns columns_of(const Bound& bound, double y, double centre_u, const Columns& parent) {
  const double half2 = bound.middle2 - bound.fall * y * y;
  if (!(half2 > 0)) return {parent.to + 1, parent.to};
  const double half = std::sqrt(half2), middle = centre_u - bound.lean * y;
  const Columns inside{-floor_of(half - middle), floor_of(middle + half)};
  if (inside.to < inside.from) return {parent.to + 1, parent.to};
  return {std::clamp(inside.from, parent.from, parent.to + 1),
          std::clamp(inside.to, parent.from - 1, parent.to)};
}

struct RingSums {
  std::int64_t n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, g = 0, gx = 0, gy = 0, gg = 0;
};

template <typename Pixel>
void add_flat(const Pixel* row, int from, int to, int origin_u, int y, RingSums& sums) {
  if (to < from) return;
  using Sum = std::conditional_t<sizeof(Pixel) == 1, int, std::int64_t>;  // of one row
  Sum sg = 0, sgx = 0, sgg = 0;
  for (int u = from; u <= to; ++u) {
    const Sum g = row[u];
    sg += g;
    sgx += g * (u - origin_u);
    sgg += g * g;
  }
  const std::int64_t n = to - from + 1, first = from - origin_u;
  const std::int64_t sx = n * first + n * (n - 1) / 2;
  sums.n += n;
  sums.x += sx;
  sums.y += n * y;
  sums.xx += n * first * first + first * n * (n - 1) + (n - 1) * n * (2 * n - 1) / 6;
  sums.xy += sx * y;
  sums.yy += n * y * y;
  sums.g += sg;
  sums.gx += sgx;
  sums.gy += sg * y;
  sums.gg += sgg;
}

// Precondition: the band has room.
template <typename Pixel>
void add_edge(const Pixel* row, int from, int to, int y, int white, float scale, EllipseBand& band) {
  float *grey = &band.grey[band.count], *x = &band.x[band.count], *ys = &band.y[band.count];
  for (int u = from; u <= to; ++u) {
    *grey++ = scale * static_cast<float>(row[u]);
    *x++ = static_cast<float>(u - band.origin_u);
    *ys++ = static_cast<float>(y);
    band.saturated += row[u] >= white ? 1 : 0;
  }
  band.count += static_cast<std::size_t>(std::max(0, to - from + 1));
}

// Room for one more row of the image and a block behind it.
void make_room(std::size_t row, EllipseBand& band) {
  const std::size_t wanted = band.count + row + 16;
  if (band.grey.size() >= wanted) return;
  for (auto* column : {&band.grey, &band.x, &band.y}) column->resize(2 * wanted);
}

FlatRing ring_of(const RingSums& s, double scale) {
  FlatRing ring;
  const auto d = [](std::int64_t value) { return static_cast<double>(value); };
  ring.ee << d(s.n), d(s.x), d(s.y), d(s.x), d(s.xx), d(s.xy), d(s.y), d(s.xy), d(s.yy);
  ring.ge << scale * d(s.g), scale * d(s.gx), scale * d(s.gy);
  ring.gg = scale * scale * d(s.gg);
  return ring;
}

// Class k lies between bound k and bound k + 1: outer rings from the outside in, edge, inner rings.
constexpr std::array<std::size_t, bounds - 1> ring_of_class{2, 1, 0, 0, 3, 4};

using Bounds = std::array<Bound, bounds>;

// Calls take(from, to) for the columns of row v that are not hidden: as a whole, or one by one.
template <typename Take>
void visible_columns(const SectorOf& sector, OutlineSectors hidden, const Eigen::Vector2d& centre_px, int v,
                     int from, int to, const Take& take) {
  if (hidden == 0) return take(from, to);
  for (int u = from; u <= to; ++u)
    if ((hidden >> sector(u - centre_px.x(), v - centre_px.y()) & 1) == 0) take(u, u);
}

template <typename Pixel>
void collect_rows(const ImageView& image, const Bounds& all, double reach_u, OutlineSectors hidden,
                  EllipseBand& band) {
  const Eigen::Vector2d centre = band.centre_px;
  const SectorOf sector(band.shape_px2);
  const auto scale = static_cast<float>(image.grey_per_count());
  std::array<RingSums, EllipseBand::outer_rings + EllipseBand::inner_rings> sums;
  const int first = std::max(0, static_cast<int>(std::ceil(centre.y() - all[0].reach_v)));
  const int last = std::min(image.height_px - 1, static_cast<int>(std::floor(centre.y() + all[0].reach_v)));
  for (int v = first; v <= last; ++v) {
    const Pixel* row = image.row<Pixel>(v);
    const int y = v - band.origin_v;
    make_room(static_cast<std::size_t>(2 * (reach_u + band.half_width_px)) + 4, band);
    Columns outside = columns_of(all[0], v - centre.y(), centre.x(), {0, image.width_px - 1});
    for (std::size_t k = 0; k + 1 < bounds; ++k) {
      const Columns inside = columns_of(all[k + 1], v - centre.y(), centre.x(), outside);
      const auto take = [&](int from, int to) {
        if (k == edge_class) {
          add_edge(row, from, to, y, image.white, scale, band);
        } else {
          add_flat(row, from, to, band.origin_u, y, sums[ring_of_class[k]]);
        }
      };
      visible_columns(sector, hidden, centre, v, outside.from, inside.from - 1, take);
      visible_columns(sector, hidden, centre, v, inside.to + 1, outside.to, take);
      outside = inside;
    }
  }
  for (std::size_t k = 0; k < sums.size(); ++k) band.rings[k] = ring_of(sums[k], scale);
}

Bounds bounds_of(const HalfAxes& axes, double half_width) {
  Bounds all;
  for (std::size_t k = 0; k <= edge_class; ++k) {
    all[k] = bound_at(axes, half_width + outer_step_px * double(edge_class - k));
  }
  for (std::size_t k = edge_class + 1; k < bounds; ++k) {
    all[k] = bound_at(axes, -half_width - inner_step_px * double(k - edge_class - 1));
  }
  return all;
}

}  // namespace

HalfAxes half_axes(const Eigen::Matrix2d& shape_px2) {
  const double mean = 0.5 * (shape_px2(0, 0) + shape_px2(1, 1));
  const double half = 0.5 * (shape_px2(0, 0) - shape_px2(1, 1));
  const double spread = std::hypot(half, shape_px2(0, 1));
  return {std::sqrt(mean + spread), std::sqrt(std::max(0.0, mean - spread)),
          0.5 * std::atan2(shape_px2(0, 1), half)};
}

bool collect_band(const ImageView& image, const Eigen::Vector2d& centre_px, const Eigen::Matrix2d& shape_px2,
                  double half_width_px, OutlineSectors hidden, EllipseBand& band) {
  const HalfAxes axes = half_axes(shape_px2);
  const Bounds all = bounds_of(axes, half_width_px);
  const double reach_v = all[edge_class].reach_v;
  const double reach_u = std::sqrt(shape_px2(0, 0)) + half_width_px;
  if (!(centre_px.x() - reach_u >= 0 && centre_px.x() + reach_u <= image.width_px - 1 &&
        centre_px.y() - reach_v >= 0 && centre_px.y() + reach_v <= image.height_px - 1)) {
    return false;
  }
  band.centre_px = centre_px;
  band.shape_px2 = shape_px2;
  band.half_width_px = half_width_px;
  band.origin_u = static_cast<int>(std::lround(centre_px.x()));
  band.origin_v = static_cast<int>(std::lround(centre_px.y()));
  band.count = 0;
  band.saturated = 0;
  band.rounding_grey2 = image.grey_per_count() * image.grey_per_count() / 12;
  if (image.two_bytes()) {
    collect_rows<std::uint16_t>(image, all, reach_u, hidden, band);
  } else {
    collect_rows<std::uint8_t>(image, all, reach_u, hidden, band);
  }
  return true;
}

}  // namespace zeropose
