#include "measure/ellipse_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "measure/ellipse_model.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using namespace ellipse_model;

State state_of(const EllipseStart& start, const EllipseBand& band, double blur_px) {
  State state;
  state.R2 = std::sqrt(start.shape_px2.determinant());
  const Eigen::Matrix2d P = state.R2 * start.shape_px2.inverse();
  state.at << start.centre_px.x() - band.origin_u, start.centre_px.y() - band.origin_v, P(0, 0), P(0, 1),
      P(1, 1), blur_px, start.background_grey, start.mark_grey, 0, 0;
  return state;
}

constexpr double settled_sigmas = 1;  // what is left to go at the end, without damping
constexpr double near_sigmas = 12;    // a step so small meets the minimum with the normal equations it has

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
    const SmallCholesky<3> solver(ring.ee);
    plane[k] = solver.solve(ring.ge);
    variance[k] = std::max(ring.squares(plane[k]), 0.0) / (ring.count() - 3);
    taken[k] = solver.ok() && plane[k].allFinite();
    if (taken[k]) quietest = std::min(quietest, variance[k]);
  }
  const double contrast = std::abs(state.at(background) - state.at(mark));
  const double most = 2.5 * quietest + band.rounding_grey2 + 1e-4 * contrast * contrast;
  const double room = 0.05 * contrast + 0.5 * std::sqrt(quietest) + 0.5;
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

// Not finite, so not plausible, where the pixels leave a direction open.
Unknowns step_from(const Normal& normal, double lambda) {
  Information N = normal.N;
  N.diagonal() *= 1 + lambda;
  const SmallCholesky<unknowns> solver(N);
  if (!solver.ok()) return Unknowns::Constant(std::numeric_limits<double>::quiet_NaN());
  return solver.solve(normal.g);
}

double variance_of(const Normal& normal, const EllipseBand& band) {
  return std::max(normal.squares / std::max(1.0, normal.count - unknowns), band.rounding_grey2);
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
  Sectors sectors{};
  bool sectors_valid = false;
  Taken taken{};
  bool rings_chosen = false;
  double lambda = 0;
  int iterations = 0;

  bool settled = false;

  Outcome run();
  double sigmas_of(const Unknowns& step) const {
    return std::sqrt(std::max(0.0, step.dot(normal.N * step)) / variance_of(normal, band));
  }
  void start_coarsely();
  bool choose_rings(const State& next);
  void try_state(const State& next, Wanted wanted);
};

// The first steps, from the region's outline, can do with a part of the pixels.
void Descent::start_coarsely() {
  const std::size_t stride = band.size() > 480 ? 4 : 2;
  for (int round = 0; round < 2; ++round) {
    evaluate_edge(band, state, Wanted::all, normal, sectors, stride);
    const Unknowns step = step_from(normal, 1e-3);
    State next = state;
    next.at += step;
    if (!next.plausible() || !(step.head<2>().norm() < 1)) return;
    state = next;
    if (step.head<2>().norm() < 0.1 && step.segment<3>(p11).norm() < 0.02) return;
  }
}

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
    Sectors seen;
    evaluate_edge(band, next, wanted, there, seen);
    add_rings(band, taken, next, wanted, there);
    if (there.squares <= normal.squares * (1 + 1e-6)) {
      state = next;
      normal = there;
      sectors = seen;
      sectors_valid = wanted == Wanted::gradient;
      lambda = lambda > 1e-3 ? lambda * 0.1 : 0;
      return;
    }
  }
  lambda = std::max(1e-2, 10 * lambda);
}

Outcome Descent::run() {
  start_coarsely();
  evaluate_edge(band, state, Wanted::all, normal, sectors);
  for (iterations = 1; iterations < 20 && lambda < 1e6; ++iterations) {
    State next = state;
    const Unknowns step = step_from(normal, lambda);
    next.at += step;
    const double sigmas = sigmas_of(step);
    if (next.plausible() && sigmas < near_sigmas && !rings_chosen) {
      if (!choose_rings(next)) {
        state = next;
        return Outcome::left_band;
      }
      continue;
    }
    if (next.plausible() && sigmas < 0.1) {
      settled = lambda == 0 || sigmas_of(step_from(normal, 0)) < settled_sigmas;
      state = next;
      normal.squares -= step.dot(normal.g);
      return Outcome::done;
    }
    try_state(next, rings_chosen && sigmas < near_sigmas && lambda == 0 ? Wanted::gradient : Wanted::all);
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

void judge_outline(const Descent& d, EllipseFit& fit) {
  Sectors sectors = d.sectors;
  if (!d.sectors_valid) {
    Normal unused;
    evaluate_edge(d.band, d.state, Wanted::gradient, unused, sectors);
  }
  const double noise2 = fit.flat_rms > 0 ? fit.flat_rms * fit.flat_rms : d.band.rounding_grey2;
  double square = 0, noise_square = 0;
  for (std::size_t k = 0; k < Sectors::count; ++k) {
    if (!(sectors.ss[k] > 0)) continue;
    const double displacement = double{sectors.rs[k]} / double{sectors.ss[k]};
    square += displacement * displacement / Sectors::count;
    noise_square += noise2 / double{sectors.ss[k]} / Sectors::count;
  }
  fit.outline_px = std::sqrt(square);
  fit.outline_noise_px = std::sqrt(noise_square);
}

// The block of N^-1 that belongs to the centre.
Eigen::Matrix2d inverse_of_centre(const SmallCholesky<unknowns>& solver) {
  const Unknowns u = solver.solve(Unknowns::Unit(cu)), v = solver.solve(Unknowns::Unit(cv));
  Eigen::Matrix2d block;
  block << u(cu), v(cu), v(cu), v(cv);
  return block;
}

EllipseFit report(const Descent& d) {
  const EllipseBand& band = d.band;
  EllipseFit fit;
  fit.iterations = d.iterations;
  fit.settled = d.settled;
  const SmallCholesky<unknowns> solver(d.normal.N);
  fit.covariance_px2 = variance_of(d.normal, band) * inverse_of_centre(solver);
  fit.centre_px = d.state.at.head<2>() + Eigen::Vector2d(band.origin_u, band.origin_v);
  fit.shape_px2 = d.state.shape();
  const double light = 1 + d.state.at(gx) * d.state.at(cu) + d.state.at(gy) * d.state.at(cv);
  fit.mark_grey = d.state.at(mark) * light;
  fit.background_grey = d.state.at(background) * light;
  fit.blur_px = d.state.at(blur);
  fit.shading_per_px = d.state.at.segment<2>(gx) / light;
  fit.flat_rms = rms_of_rings(band, d.taken, d.state);
  fit.edge_count = double(band.size());
  fit.flat_count = d.normal.count - fit.edge_count;
  const double flat_squares = fit.flat_rms * fit.flat_rms * fit.flat_count;
  fit.edge_rms = std::sqrt(std::max(0.0, d.normal.squares - flat_squares) / fit.edge_count);
  judge_outline(d, fit);
  fit.saturated_share = band.saturated / fit.edge_count;
  fit.converged = solver.ok() && fit.covariance_px2.allFinite() && fit.covariance_px2.determinant() > 0 &&
                  fit.covariance_px2(0, 0) > 0;
  return fit;
}

}  // namespace

EllipseFit fit_ellipse(const ImageView& image, const EllipseStart& start, EllipseWorkspace& workspace,
                       const BlurShape& blur_shape) {
  EllipseBand& band = workspace.band;
  EllipseStart from = start;
  double half_width_px = start.band_px, blur_px = 0.8;
  for (int round = 0; round < 4; ++round) {
    if (!(from.shape_px2.determinant() > 0) ||
        !collect_band(image, from.centre_px, from.shape_px2, half_width_px, from.hidden, band) ||
        band.size() < 4 * unknowns) {
      return {};
    }
    Descent descent{band, state_of(from, band, blur_px)};
    descent.state.blur_c = blur_shape.c;
    descent.state.blur_s = blur_shape.s;
    const Outcome outcome = descent.run();
    if (outcome == Outcome::done) return report(descent);
    if (outcome == Outcome::failed) return {};
    const State& state = descent.state;
    from.centre_px = state.at.head<2>() + Eigen::Vector2d(band.origin_u, band.origin_v);
    from.shape_px2 = state.shape();
    from.mark_grey = state.at(mark);
    from.background_grey = state.at(background);
    blur_px = state.at(blur);
    half_width_px = std::max(start.band_px, 3.2 * blur_px);
  }
  return {};
}

}  // namespace zeropose
