#include "measure/ellipse_band.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace zeropose {
namespace {

constexpr double outer_step_px = 1.5, inner_step_px = 2.25;
constexpr std::size_t bound_count = 7;  // outlines between the classes of pixels, from the outside in
constexpr std::size_t edge_class = 3;

// Outlines moved by offsets along the half axes, side by side so that the compiler takes them at once. Row y
// (from the centre) of one reaches from -lean y - sqrt(middle2 - fall y^2) to -lean y + sqrt(..).
struct Bounds {
  static constexpr std::size_t lanes = 8;
  alignas(64) std::array<double, lanes> lean{}, middle2{}, fall{};
  std::array<double, lanes> reach_v{};

  Bounds() { middle2.fill(-1); }  // no row at all
};

// None if nothing is left of it.
void set_bound(const HalfAxes& axes, double offset, std::size_t k, Bounds& bounds) {
  const double a = axes.major_px + offset, b = axes.minor_px + offset;
  if (b < 0.5) return;
  const double c = std::cos(axes.angle_rad), s = std::sin(axes.angle_rad);
  const double ia = 1 / (a * a), ib = 1 / (b * b);
  const double A = c * c * ia + s * s * ib, B = c * s * (ia - ib);
  bounds.lean[k] = B / A;
  bounds.middle2[k] = 1 / A;
  bounds.fall[k] = ia * ib / (A * A);
  bounds.reach_v[k] = std::sqrt(a * a * s * s + b * b * c * c);
}

// Columns from..past-1 of one row inside each bound, none where from is past.
struct Cuts {
  std::array<int, Bounds::lanes> from, past;
};

[[gnu::always_inline]] inline Cuts cuts_of(const Bounds& bounds, double y, double centre_u) {
  Cuts cuts;
  for (std::size_t k = 0; k < Bounds::lanes; ++k) {
    const double half2 = bounds.middle2[k] - bounds.fall[k] * y * y;
    const double half = std::sqrt(std::max(half2, 0.0)), middle = centre_u - bounds.lean[k] * y;
    const double low = middle - half, high = middle + half;
    const int first = static_cast<int>(low), last = static_cast<int>(high);
    const int from = first + (first < low ? 1 : 0), past = last + (last > high ? 0 : 1);
    cuts.from[k] = from;
    cuts.past[k] = half2 > 0 ? past : from;
  }
  return cuts;
}

struct Columns {
  int from = 0, past = 0;
};

// Of one inside the parent; an empty one lies at its end, so that classes remain nested.
Columns columns_of(const Cuts& cuts, std::size_t k, const Columns& parent) {
  if (cuts.past[k] <= cuts.from[k]) return {parent.past, parent.past};
  const int from = std::clamp(cuts.from[k], parent.from, parent.past);
  return {from, std::clamp(cuts.past[k], from, parent.past)};
}

// Of a row: number of pixels, twice the sum of x and six times that of x^2, which are whole polynomials of
// the columns; grey, grey x, grey^2.
struct RowSums {
  std::int64_t n = 0, x2 = 0, xx6 = 0, g = 0, gx = 0, gg = 0;
};

struct RingSums {
  std::int64_t n = 0, x2 = 0, y = 0, xx6 = 0, xy2 = 0, yy = 0, g = 0, gx = 0, gy = 0, gg = 0;

  void add(const RowSums& row, std::int64_t v) {
    n += row.n, x2 += row.x2, xx6 += row.xx6;
    y += row.n * v, yy += row.n * v * v, xy2 += row.x2 * v;
    g += row.g, gx += row.gx, gg += row.gg;
    gy += row.g * v;
  }
};

// x from the origin.
template <typename Pixel>
void add_flat(const Pixel* origin, int from, int past, RowSums& sums) {
  if (past <= from) return;
  using Sum = std::conditional_t<sizeof(Pixel) == 1, int, std::int64_t>;
  Sum sg = 0, sgx = 0, sgg = 0;
  for (int x = from; x < past; ++x) {
    const Sum g = origin[x];
    sg += g;
    sgx += g * x;
    sgg += g * g;
  }
  const std::int64_t a = from, b = past;
  sums.n += b - a;
  sums.x2 += (b - a) * (a + b - 1);
  sums.xx6 += b * (b - 1) * (2 * b - 1) - a * (a - 1) * (2 * a - 1);
  sums.g += sg;
  sums.gx += sgx;
  sums.gg += sgg;
}

// x from the origin. Precondition: the band has room.
template <typename Pixel>
void add_edge(const Pixel* origin, int from, int past, int y, int white, float scale, EllipseBand& band) {
  float *grey = &band.grey[band.count], *x = &band.x[band.count], *ys = &band.y[band.count];
  int saturated = 0;
  for (int u = from; u < past; ++u) {
    *grey++ = scale * static_cast<float>(origin[u]);
    *x++ = static_cast<float>(u);
    *ys++ = static_cast<float>(y);
    saturated += origin[u] >= white ? 1 : 0;
  }
  band.saturated += saturated;
  band.count += static_cast<std::size_t>(std::max(0, past - from));
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
  const double x = d(s.x2) / 2, xx = d(s.xx6) / 6, xy = d(s.xy2) / 2;
  ring.ee << d(s.n), x, d(s.y), x, xx, xy, d(s.y), xy, d(s.yy);
  ring.ge << scale * d(s.g), scale * d(s.gx), scale * d(s.gy);
  ring.gg = scale * scale * d(s.gg);
  return ring;
}

// Class k lies between bound k and bound k + 1: outer rings from the outside in, edge, inner rings.
constexpr std::array<std::size_t, bound_count - 1> ring_of_class{2, 1, 0, 0, 3, 4};

// Calls take(from, past) for the columns of row v, both from the origin, that are not hidden: as a whole, or
// one by one.
template <typename Take>
void visible_columns(const SectorOf& sector, OutlineSectors hidden, const Eigen::Vector2d& centre, int y,
                     int from, int past, const Take& take) {
  if (hidden == 0) return take(from, past);
  for (int x = from; x < past; ++x)
    if ((hidden >> sector(x - centre.x(), y - centre.y()) & 1) == 0) take(x, x + 1);
}

template <typename Pixel>
void collect_rows(const ImageView& image, const Bounds& bounds, double reach_u, OutlineSectors hidden,
                  EllipseBand& band) {
  const Eigen::Vector2d centre = band.centre_px - Eigen::Vector2d(band.origin_u, band.origin_v);
  const SectorOf sector(band.shape_px2);
  const auto scale = static_cast<float>(image.grey_per_count());
  std::array<RingSums, EllipseBand::outer_rings + EllipseBand::inner_rings> sums;
  const int first = std::max(-band.origin_v, static_cast<int>(std::ceil(centre.y() - bounds.reach_v[0])));
  const int last = std::min(image.height_px - 1 - band.origin_v,
                            static_cast<int>(std::floor(centre.y() + bounds.reach_v[0])));
  for (int y = first; y <= last; ++y) {
    const Pixel* origin = image.row<Pixel>(y + band.origin_v) + band.origin_u;
    make_room(static_cast<std::size_t>(2 * (reach_u + band.half_width_px)) + 4, band);
    const Cuts cuts = cuts_of(bounds, y - centre.y(), centre.x());
    Columns outside = columns_of(cuts, 0, {-band.origin_u, image.width_px - band.origin_u});
    for (std::size_t k = 0; k + 1 < bound_count; ++k) {
      const Columns inside = columns_of(cuts, k + 1, outside);
      RowSums row;
      const auto take = [&](int from, int past) {
        if (k == edge_class) {
          add_edge(origin, from, past, y, image.white, scale, band);
        } else {
          add_flat(origin, from, past, row);
        }
      };
      visible_columns(sector, hidden, centre, y, outside.from, inside.from, take);
      visible_columns(sector, hidden, centre, y, inside.past, outside.past, take);
      if (k != edge_class) sums[ring_of_class[k]].add(row, y);
      outside = inside;
    }
  }
  for (std::size_t k = 0; k < sums.size(); ++k) band.rings[k] = ring_of(sums[k], scale);
}

Bounds bounds_of(const HalfAxes& axes, double half_width) {
  Bounds all;
  for (std::size_t k = 0; k <= edge_class; ++k) {
    set_bound(axes, half_width + outer_step_px * double(edge_class - k), k, all);
  }
  for (std::size_t k = edge_class + 1; k < bound_count; ++k) {
    set_bound(axes, -half_width - inner_step_px * double(k - edge_class - 1), k, all);
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
  const double reach_v = all.reach_v[edge_class];
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
