#include "measure/ellipse_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

namespace zeropose {
namespace {

constexpr int unknowns = 10;
enum Unknown { cu, cv, p11, p12, p22, blur, background, mark, gx, gy };
using Unknowns = Eigen::Matrix<double, unknowns, 1>;
using Information = Eigen::Matrix<double, unknowns, unknowns>;

constexpr double rounding_variance = 1.0 / 12;
constexpr double smallest_blur_px = 0.25, largest_blur_px = 4;

// cu cv relative to the band's origin; P = R^2 times the inverse shape, so that its elements are near 1.
struct State {
  Unknowns at = Unknowns::Zero();
  double R2 = 1;

  Eigen::Matrix2d shape() const {
    Eigen::Matrix2d P;
    P << at(p11), at(p12), at(p12), at(p22);
    return R2 * P.inverse();
  }
  bool plausible() const {
    return at.allFinite() && at(p11) > 0 && at(p11) * at(p22) - at(p12) * at(p12) > 1e-4 &&
           at(blur) > smallest_blur_px && at(blur) < largest_blur_px;
  }
};

State state_of(const EllipseStart& start, const EllipseBand& band, double blur_px) {
  State state;
  state.R2 = std::sqrt(start.shape_px2.determinant());
  const Eigen::Matrix2d P = state.R2 * start.shape_px2.inverse();
  state.at << start.centre_px.x() - band.origin_u, start.centre_px.y() - band.origin_v, P(0, 0), P(0, 1),
      P(1, 1), blur_px, start.background_grey, start.mark_grey, 0, 0;
  return state;
}

struct Bell {
  float density, below;  // of the standard normal distribution
};

// Good to 1e-6 for the density and 1e-5 for the integral (Abramowitz and Stegun 26.2.17); free of branches,
// so that the compiler turns the loop round it into vector code.
inline Bell bell(float t) {
  const float size = std::min(std::abs(t), 5.0F);
  const float y = size * size * (-0.5F / 32);
  float e = 1 + y * (1 + y * (1.0F / 2) * (1 + y * (1.0F / 3) * (1 + y * (1.0F / 4) * (1 + y * (1.0F / 5)))));
  e *= e, e *= e, e *= e, e *= e, e *= e;
  const float density = 0.398942280F * e, k = 1 / (1 + 0.2316419F * size);
  const float tail =
      density * k *
      (0.319381530F + k * (-0.356563782F + k * (1.781477937F + k * (-1.821255978F + k * 1.330274429F))));
  return {density, t < 0 ? tail : 1 - tail};
}

constexpr std::size_t block_size = 16, columns = unknowns + 1;

// Ten derivatives and the residual (last) of some pixels, one row each.
struct Block {
  alignas(64) float row[columns][block_size];
};

// What differentiate() needs of the state, in single precision.
struct Constants {
  explicit Constants(const State& state)
      : u(float(state.at(cu))),
        v(float(state.at(cv))),
        r2(float(1 / state.R2)),
        a(float(state.at(p11)) * r2),
        b(float(state.at(p12)) * r2),
        c(float(state.at(p22)) * r2),
        low(float(state.at(mark))),
        step(float(state.at(background) - state.at(mark))),
        inverse_blur(float(1 / state.at(blur))),
        light_x(float(state.at(gx))),
        light_y(float(state.at(gy))) {}
  float u, v, r2, a, b, c, low, step, inverse_blur, light_x, light_y;
};

void differentiate(const float* __restrict grey, const float* __restrict px, const float* __restrict py,
                   const Constants k, Block& __restrict out) {
  for (std::size_t i = 0; i < block_size; ++i) {
    const float x = px[i] - k.u, y = py[i] - k.v;
    const float wx = k.a * x + k.b * y, wy = k.b * x + k.c * y;
    const float q = std::max(x * wx + y * wy, 1e-6F), rho = std::sqrt(q);
    const float im = 1 / std::sqrt(wx * wx + wy * wy + 1e-12F);
    const float d = (q - rho) * im;
    const Bell edge = bell(d * k.inverse_blur);
    const float light = 1 + k.light_x * px[i] + k.light_y * py[i];
    const float level = k.low + k.step * edge.below;
    const float slope = light * k.step * edge.density * k.inverse_blur;
    const float by_q = slope * im * (1 - 0.5F / rho), by_m = slope * d * im * im;
    out.row[cu][i] = by_m * (k.a * wx + k.b * wy) - 2 * by_q * wx;
    out.row[cv][i] = by_m * (k.b * wx + k.c * wy) - 2 * by_q * wy;
    out.row[p11][i] = (by_q * x - by_m * wx) * x * k.r2;
    out.row[p12][i] = (2 * by_q * x * y - by_m * (wx * y + wy * x)) * k.r2;
    out.row[p22][i] = (by_q * y - by_m * wy) * y * k.r2;
    out.row[blur][i] = -slope * d * k.inverse_blur;
    out.row[background][i] = light * edge.below;
    out.row[mark][i] = light * (1 - edge.below);
    out.row[gx][i] = level * px[i];
    out.row[gy][i] = level * py[i];
    out.row[unknowns][i] = grey[i] - light * level;
  }
}

// Sums of products of pairs of rows, four partial sums each: the residual's pairs first.
struct Products {
  alignas(64) float sum[columns * (columns + 1) / 2][4] = {};
};

enum class Wanted { all, gradient };

void add_products(const Block& __restrict block, Wanted wanted, Products& __restrict products) {
  float(*__restrict sum)[4] = products.sum;
  const std::size_t last = wanted == Wanted::gradient ? unknowns : 0;
  for (std::size_t i = columns; i-- > last;) {
    const float* __restrict a = block.row[i];
    for (std::size_t j = 0; j <= i; ++j, ++sum) {
      const float* __restrict b = block.row[j];
      for (std::size_t l = 0; l < 4; ++l) {
        (*sum)[l] += (a[l] * b[l] + a[l + 4] * b[l + 4]) + (a[l + 8] * b[l + 8] + a[l + 12] * b[l + 12]);
      }
    }
  }
}

struct Normal {
  Information N = Information::Zero();
  Unknowns g = Unknowns::Zero();
  double squares = 0, count = 0;
};

// Takes over what was wanted, leaves the rest.
void unpack(const Products& products, Wanted wanted, Normal& normal) {
  const auto total = [&products](Eigen::Index pair) {
    const float* sum = products.sum[pair];
    return (double{sum[0]} + double{sum[1]}) + (double{sum[2]} + double{sum[3]});
  };
  Eigen::Index pair = 0;
  for (; pair < unknowns; ++pair) normal.g(pair) = total(pair);
  normal.squares = total(pair++);
  if (wanted == Wanted::gradient) return;
  for (Eigen::Index i = unknowns; i-- > 0;) {
    for (Eigen::Index j = 0; j <= i; ++j, ++pair) normal.N(i, j) = normal.N(j, i) = total(pair);
  }
}

void evaluate_edge(const EllipseBand& band, const State& state, Wanted wanted, Normal& normal) {
  const Constants constants(state);
  Products products;
  Block block;
  const std::size_t n = band.grey.size();
  std::size_t i = 0;
  for (; i + block_size <= n; i += block_size) {
    differentiate(&band.grey[i], &band.x[i], &band.y[i], constants, block);
    add_products(block, wanted, products);
  }
  if (i < n) {
    std::array<float, block_size> grey{}, x{}, y{};
    std::copy(band.grey.begin() + std::ptrdiff_t(i), band.grey.end(), grey.begin());
    std::copy(band.x.begin() + std::ptrdiff_t(i), band.x.end(), x.begin());
    std::copy(band.y.begin() + std::ptrdiff_t(i), band.y.end(), y.begin());
    differentiate(grey.data(), x.data(), y.data(), constants, block);
    for (auto& row : block.row) std::fill(row + (n - i), row + block_size, 0.0F);
    add_products(block, wanted, products);
  }
  unpack(products, wanted, normal);
  normal.count = double(n);
}

bool is_outer(std::size_t ring) { return ring < EllipseBand::outer_rings; }

Eigen::Vector3d plane_of(const State& state, std::size_t ring) {
  return state.at(is_outer(ring) ? background : mark) * Eigen::Vector3d(1, state.at(gx), state.at(gy));
}

void add_ring(const FlatRing& ring, std::size_t index, const State& state, Wanted wanted, Normal& normal) {
  const Eigen::Index own = is_outer(index) ? background : mark;
  const Eigen::Vector3d plane = plane_of(state, index), rest = ring.ge - ring.ee * plane;
  Eigen::Matrix3d T = state.at(own) * Eigen::Matrix3d::Identity();  // plane by level, gx, gy
  T.col(0) << 1, state.at(gx), state.at(gy);
  const Eigen::Vector3d g = T.transpose() * rest;
  const std::array<Eigen::Index, 3> index_of{own, gx, gy};
  for (Eigen::Index i = 0; i < 3; ++i) normal.g(index_of[std::size_t(i)]) += g(i);
  normal.squares += ring.squares(plane);
  normal.count += ring.count();
  if (wanted == Wanted::gradient) return;
  const Eigen::Matrix3d N = T.transpose() * ring.ee * T;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j)
      normal.N(index_of[std::size_t(i)], index_of[std::size_t(j)]) += N(i, j);
  }
}

using Taken = std::array<bool, EllipseBand::outer_rings + EllipseBand::inner_rings>;

// Rings that are flat (variance about their own plane like that of the quietest ring) and at the level the
// band found. A ring further off needs the one before it.
Taken flat_rings(const EllipseBand& band, const State& state) {
  Taken taken{};
  std::array<double, std::tuple_size_v<Taken>> variance{};
  std::array<Eigen::Vector3d, std::tuple_size_v<Taken>> plane;
  double quietest = 1e9;
  for (std::size_t k = 0; k < taken.size(); ++k) {
    const FlatRing& ring = band.rings[k];
    if (ring.count() < 16) continue;
    const Eigen::LDLT<Eigen::Matrix3d> solver(ring.ee);
    plane[k] = solver.solve(ring.ge);
    variance[k] = std::max(ring.squares(plane[k]), 0.0) / (ring.count() - 3);
    taken[k] = solver.info() == Eigen::Success && plane[k].allFinite();
    if (taken[k]) quietest = std::min(quietest, variance[k]);
  }
  const double contrast = std::abs(state.at(background) - state.at(mark));
  const double most = 2.5 * quietest + rounding_variance + 1e-4 * contrast * contrast;
  const double room = 0.05 * contrast + 2 * std::sqrt(quietest) / 4 + 0.5;
  for (std::size_t k = 0; k < taken.size(); ++k) {
    const bool first = k == 0 || k == EllipseBand::outer_rings;
    taken[k] = taken[k] && variance[k] <= most && (first || taken[k - 1]) &&
               std::abs(plane[k](0) - plane_of(state, k)(0)) <= room;
  }
  return taken;
}

void add_rings(const EllipseBand& band, const Taken& taken, const State& state, Wanted wanted,
               Normal& normal) {
  for (std::size_t k = 0; k < taken.size(); ++k) {
    if (taken[k]) add_ring(band.rings[k], k, state, wanted, normal);
  }
}

Unknowns step_from(const Normal& normal, double lambda) {
  Information N = normal.N;
  N.diagonal() *= 1 + lambda;
  return N.ldlt().solve(normal.g);
}

double variance_of(const Normal& normal) {
  return std::max(normal.squares / std::max(1.0, normal.count - unknowns), rounding_variance);
}

// Did the outline stay in the band that was collected for it?
bool band_holds(const EllipseBand& band, const State& state) {
  const HalfAxes before = half_axes(band.shape_px2), after = half_axes(state.shape());
  const Eigen::Vector2d origin(band.origin_u, band.origin_v);
  return (state.at.head<2>() + origin - band.centre_px).norm() < 0.4 &&
         std::abs(after.major_px - before.major_px) < 0.4 &&
         std::abs(after.minor_px - before.minor_px) < 0.4 && 2.5 * state.at(blur) < band.half_width_px;
}

enum class Outcome { failed, left_band, done };

// Levenberg-Marquardt over one band: first on the pixels across the outline alone; once steps are small the
// rings that prove flat join.
struct Descent {
  const EllipseBand& band;
  State state;
  Normal normal{};
  Taken taken{};
  bool rings_chosen = false;
  double lambda = 0;
  int iterations = 0;

  Outcome run();
  bool choose_rings(const State& next);
  void try_state(const State& next, Wanted wanted);
};

bool Descent::choose_rings(const State& next) {
  if (!band_holds(band, next)) return false;
  taken = flat_rings(band, next);
  rings_chosen = true;
  add_rings(band, taken, state, Wanted::all, normal);
  return true;
}

// Moves there if that lowers the sum of squares.
void Descent::try_state(const State& next, Wanted wanted) {
  if (next.plausible()) {
    Normal there = normal;
    evaluate_edge(band, next, wanted, there);
    add_rings(band, taken, next, wanted, there);
    if (there.squares <= normal.squares * (1 + 1e-6)) {
      state = next;
      normal = there;
      lambda = lambda > 1e-3 ? lambda * 0.1 : 0;
      return;
    }
  }
  lambda = std::max(1e-2, 10 * lambda);
}

Outcome Descent::run() {
  evaluate_edge(band, state, Wanted::all, normal);
  for (iterations = 1; iterations < 20 && lambda < 1e6; ++iterations) {
    State next = state;
    const Unknowns step = step_from(normal, lambda);
    next.at += step;
    const double sigmas = std::sqrt(std::max(0.0, step.dot(normal.N * step)) / variance_of(normal));
    if (next.plausible() && sigmas < 6 && !rings_chosen) {
      if (!choose_rings(next)) {
        state = next;
        return Outcome::left_band;
      }
      continue;
    }
    if (next.plausible() && sigmas < 0.1) {
      state = next;
      normal.squares -= step.dot(normal.g);
      return Outcome::done;
    }
    try_state(next, rings_chosen && sigmas < 6 && lambda == 0 ? Wanted::gradient : Wanted::all);
  }
  return Outcome::failed;
}

double rms_of_rings(const EllipseBand& band, const Taken& taken, const State& state) {
  double squares = 0, count = 0;
  for (std::size_t k = 0; k < taken.size(); ++k) {
    if (!taken[k]) continue;
    squares += band.rings[k].squares(plane_of(state, k));
    count += band.rings[k].count();
  }
  return count > 0 ? std::sqrt(std::max(0.0, squares / count)) : 0;
}

// Displacement of the outline by sector: least squares of the residuals on the slope across the outline.
struct Sectors {
  static constexpr std::size_t count = 16;
  std::array<double, count> rs{}, ss{};

  void add(double x, double y, double slope, double residual) {
    const double ax = std::abs(x), ay = std::abs(y), low = std::min(ax, ay), high = std::max(ax, ay);
    const std::size_t octant = (x < 0 ? 1U : 0U) + (y < 0 ? 2U : 0U) + (ax < ay ? 4U : 0U);
    const std::size_t sector = 2 * octant + (low > 0.4142 * high ? 1U : 0U);  // tan 22.5 deg
    rs[sector] += residual * slope;
    ss[sector] += slope * slope;
  }
};

Sectors sectors_of(const EllipseBand& band, const State& state) {
  const Constants constants(state);
  Block block;
  Sectors sectors;
  for (std::size_t i = 0; i + block_size <= band.grey.size(); i += block_size) {
    differentiate(&band.grey[i], &band.x[i], &band.y[i], constants, block);
    for (std::size_t k = 0; k < block_size; ++k) {
      const float du = block.row[cu][k], dv = block.row[cv][k];
      sectors.add(double{band.x[i + k]} - state.at(cu), double{band.y[i + k]} - state.at(cv),
                  std::sqrt(double{du * du + dv * dv}), double{block.row[unknowns][k]});
    }
  }
  return sectors;
}

void judge_outline(const Descent& d, EllipseFit& fit) {
  const Sectors sectors = sectors_of(d.band, d.state);
  const double noise2 = fit.flat_rms > 0 ? fit.flat_rms * fit.flat_rms : rounding_variance;
  double square = 0, noise_square = 0;
  for (std::size_t k = 0; k < Sectors::count; ++k) {
    if (!(sectors.ss[k] > 0)) continue;
    square += (sectors.rs[k] / sectors.ss[k]) * (sectors.rs[k] / sectors.ss[k]) / Sectors::count;
    noise_square += noise2 / sectors.ss[k] / Sectors::count;
  }
  fit.outline_px = std::sqrt(square);
  fit.outline_noise_px = std::sqrt(noise_square);
}

EllipseFit report(const Descent& d) {
  const EllipseBand& band = d.band;
  EllipseFit fit;
  fit.iterations = d.iterations;
  const Eigen::LDLT<Information> solver(d.normal.N);
  Eigen::Matrix<double, unknowns, 2> unit = Eigen::Matrix<double, unknowns, 2>::Zero();
  unit(cu, 0) = unit(cv, 1) = 1;
  const Eigen::Matrix2d inverse = solver.solve(unit).topRows<2>();
  fit.covariance_px2 = 0.5 * variance_of(d.normal) * (inverse + inverse.transpose());
  fit.centre_px = d.state.at.head<2>() + Eigen::Vector2d(band.origin_u, band.origin_v);
  fit.shape_px2 = d.state.shape();
  const double light = 1 + d.state.at(gx) * d.state.at(cu) + d.state.at(gy) * d.state.at(cv);
  fit.mark_grey = d.state.at(mark) * light;
  fit.background_grey = d.state.at(background) * light;
  fit.blur_px = d.state.at(blur);
  fit.flat_rms = rms_of_rings(band, d.taken, d.state);
  fit.edge_count = double(band.grey.size());
  fit.flat_count = d.normal.count - fit.edge_count;
  const double flat_squares = fit.flat_rms * fit.flat_rms * fit.flat_count;
  fit.edge_rms = std::sqrt(std::max(0.0, d.normal.squares - flat_squares) / fit.edge_count);
  judge_outline(d, fit);
  fit.saturated_share = band.saturated / fit.edge_count;
  fit.converged = solver.info() == Eigen::Success && fit.covariance_px2.allFinite() &&
                  fit.covariance_px2.determinant() > 0 && fit.covariance_px2(0, 0) > 0;
  return fit;
}

}  // namespace

EllipseFit fit_ellipse(const ImageView& image, const EllipseStart& start, EllipseWorkspace& workspace) {
  EllipseBand& band = workspace.band;
  EllipseStart from = start;
  double half_width_px = ellipse_band_px, blur_px = 0.8;
  for (int round = 0; round < 4; ++round) {
    if (!(from.shape_px2.determinant() > 0) ||
        !collect_band(image, from.centre_px, from.shape_px2, half_width_px, band) ||
        band.grey.size() < 4 * unknowns) {
      return {};
    }
    Descent descent{band, state_of(from, band, blur_px)};
    const Outcome outcome = descent.run();
    if (outcome == Outcome::done) return report(descent);
    if (outcome == Outcome::failed) return {};
    const State& state = descent.state;
    from.centre_px = state.at.head<2>() + Eigen::Vector2d(band.origin_u, band.origin_v);
    from.shape_px2 = state.shape();
    from.mark_grey = state.at(mark);
    from.background_grey = state.at(background);
    blur_px = state.at(blur);
    half_width_px = std::max(ellipse_band_px, 3.2 * blur_px);
  }
  return {};
}

}  // namespace zeropose
