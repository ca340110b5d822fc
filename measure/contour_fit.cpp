#include "measure/contour_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "measure/contour_cells.h"
#include "measure/contour_model.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using namespace contour;

constexpr double smallest_blur_px = 0.2, largest_blur_px = 6;
constexpr double soft_start_px = 2;   // of a second attempt
constexpr double band_room_px = 0.4;  // how far the outline may go within its band
constexpr double first_step_sigmas = 0.5, last_step_sigmas = 0.1;
constexpr int most_iterations = 30, most_rounds = 5, most_judgements = 10;

ShapeParameters shape_of(const Unknowns& at) { return at.head<most_shape_parameters>(); }

bool plausible(const ContourShape& shape, const Unknowns& at) {
  return at.allFinite() && at(blur) > smallest_blur_px && at(blur) < largest_blur_px &&
         shape.plausible(shape_of(at));
}

double variance_of(const NormalSums& normal, int shape_size, double rounding_variance) {
  const double unknown = shape_size + unknowns - blur;
  return std::max(normal.squares / std::max(1.0, normal.count - unknown), rounding_variance);
}

// Not finite, so not plausible, where the pixels leave a direction open.
Unknowns step_from(const NormalSums& normal, double lambda) {
  Information N = normal.N;
  N.diagonal() *= 1 + lambda;
  const SmallCholesky<unknowns> solver(N);
  if (!solver.ok()) return Unknowns::Constant(std::numeric_limits<double>::quiet_NaN());
  return solver.solve(normal.g);
}

// Without the shading: across a soft edge alone it cannot be told from the slope of the edge.
void hold_shading(NormalSums& normal) {
  normal.N.rightCols<2>().setZero();
  normal.N.bottomRows<2>().setZero();
  normal.N(gx, gx) = normal.N(gy, gy) = 1;
  normal.g.tail<2>().setZero();
}

// One fit: a state that goes down over bands and choices of cells.
class ContourDescent {
 public:
  ContourDescent(const GreyWindow& window, const ContourShape& shape, const ContourStart& start,
                 ContourWorkspace& workspace)
      : window_(window), shape_(shape), about_(start), work_(workspace) {}

  ContourFit run();

 private:
  bool begin_band();
  bool start_levels();
  bool descend(double step_sigmas, bool even_light);
  NormalSums sums_at(const Unknowns& at, bool even_light) const;
  bool settle_cells();
  bool band_holds() const;
  bool enough() const { return work_.active.edge.size() >= 4 * std::size_t(shape_.size() + 5); }
  bool choose(const CellVerdict& verdict);
  CellVerdict judge();
  ContourFit report(const CellVerdict& verdict) const;

  const GreyWindow& window_;
  const ContourShape& shape_;
  ContourStart about_;  // what the band was collected for
  ContourWorkspace& work_;
  Unknowns at_ = Unknowns::Zero();
  NormalSums normal_;
  CellVerdict verdict_;
  int iterations_ = 0;
};

// The pixels across the outline; of stretches that were left out before, none: they would pull the outline
// away once more.
bool ContourDescent::begin_band() {
  collect_band(window_, shape_, about_, work_.row, work_.band);
  const PixelBand& band = work_.band;
  work_.all.resize(band.size());
  std::iota(work_.all.begin(), work_.all.end(), 0U);
  work_.active = {};
  for (const std::uint32_t i : work_.all) {
    if (verdict_.stretch_used.empty() || verdict_.stretch_used[std::size_t(band.stretch[i])]) {
      work_.active.edge.push_back(i);
    }
  }
  return enough();
}

// With both levels 0 the residuals are the grey levels: least squares of them on the cover.
bool ContourDescent::start_levels() {
  at_.head<most_shape_parameters>() = about_.shape;
  at_(blur) = about_.blur_px;
  const NormalSums sums = normal_sums(work_.band, work_.active, shape_, at_);
  const double bb = sums.N(background, background), bm = sums.N(background, mark), mm = sums.N(mark, mark);
  const double determinant = bb * mm - bm * bm;
  if (!(determinant > 0)) return false;
  at_(background) = (mm * sums.g(background) - bm * sums.g(mark)) / determinant;
  at_(mark) = (bb * sums.g(mark) - bm * sums.g(background)) / determinant;
  return at_.allFinite();
}

NormalSums ContourDescent::sums_at(const Unknowns& at, bool even_light) const {
  NormalSums sums = normal_sums(work_.band, work_.active, shape_, at);
  if (even_light) hold_shading(sums);
  return sums;
}

// Levenberg-Marquardt over the active pixels, until a step is that small. even_light: the shading stays.
bool ContourDescent::descend(double step_sigmas, bool even_light) {
  normal_ = sums_at(at_, even_light);
  double lambda = 0;
  for (int k = 0; k < most_iterations && lambda < 1e7; ++k, ++iterations_) {
    const Unknowns step = step_from(normal_, lambda), next = at_ + step;
    if (plausible(shape_, next)) {
      const double variance = variance_of(normal_, shape_.size(), window_.rounding_variance);
      if (std::sqrt(std::max(0.0, step.dot(normal_.N * step)) / variance) < step_sigmas &&
          lambda <= 1) {  // beyond it a step is small only by damping, which is no end
        at_ = next;
        return true;
      }
      const NormalSums there = sums_at(next, even_light);
      if (there.squares <= normal_.squares * (1 + 1e-6)) {
        at_ = next;
        normal_ = there;
        lambda = lambda > 1e-4 ? 0.1 * lambda : 0;
        continue;
      }
    }
    lambda = std::max(1e-3, 10 * lambda);
  }
  return false;
}

bool ContourDescent::band_holds() const {
  const double wanted = contour_core_px(at_(blur)), core = work_.band.core_px;
  return shape_.movement_px(about_.shape, shape_of(at_)) < band_room_px && wanted < 1.2 * core &&
         wanted > 0.7 * core;
}

CellVerdict ContourDescent::judge() {
  find_residuals(work_.band, work_.all, shape_, at_, work_.residuals);
  return judge_cells(work_.band, work_.residuals, shape_.stretches(), at_, window_.rounding_variance);
}

// True if the choice changed.
bool ContourDescent::choose(const CellVerdict& verdict) {
  const bool changed =
      verdict.stretch_used != verdict_.stretch_used || verdict.cell_used != verdict_.cell_used;
  verdict_ = verdict;
  if (!changed) return false;
  work_.active.edge.clear();
  for (const std::uint32_t i : work_.all) {
    if (verdict.stretch_used[std::size_t(work_.band.stretch[i])]) work_.active.edge.push_back(i);
  }
  work_.active.background = work_.active.mark = {};
  for (std::size_t k = 0; k < verdict.cell_used.size(); ++k) {
    if (!verdict.cell_used[k]) continue;
    (shows_background(k) ? work_.active.background : work_.active.mark).add(work_.band.flat[k]);
  }
  return true;
}

bool ContourDescent::settle_cells() {
  verdict_.cell_used.clear();  // of another band
  for (int k = 0; k < most_judgements; ++k) {
    if (!choose(judge())) return true;
    if (!enough() || !descend(last_step_sigmas, false)) return false;
  }
  return true;
}

ContourFit ContourDescent::report(const CellVerdict& verdict) const {
  ContourFit fit;
  const SmallCholesky<unknowns> solver(normal_.N);
  if (!solver.ok()) return fit;
  const Information inverse = solver.inverse();
  const double variance = variance_of(normal_, shape_.size(), window_.rounding_variance);
  for (int i = 0; i < shape_.size(); ++i) {
    for (int j = 0; j < shape_.size(); ++j) fit.covariance(i, j) = variance * inverse(i, j);
  }
  fit.shape = shape_of(at_);
  fit.mark_grey = at_(mark);
  fit.background_grey = at_(background);
  fit.blur_px = at_(blur);
  fit.edge_rms = verdict.core_rms;
  fit.noise_rms = verdict.noise_rms;
  fit.flat_rms = verdict.flat_rms;
  fit.outline_px = verdict.outline_px;
  fit.outline_noise_px = verdict.outline_noise_px;
  fit.outline_share = verdict.share;
  fit.stretch_used = verdict.stretch_used;
  fit.saturated_share = double(work_.band.saturated) / double(std::max<std::size_t>(1, work_.band.size()));
  fit.pixels = normal_.count;
  fit.iterations = iterations_;
  fit.converged =
      fit.covariance.allFinite() && fit.covariance(0, 0) > 0 && fit.outline_share >= contour_least_share;
  return fit;
}

ContourFit ContourDescent::run() {
  for (int round = 0; round < most_rounds; ++round) {
    if (!begin_band() || (round == 0 && !start_levels()) || !descend(first_step_sigmas, true)) return {};
    if (!band_holds()) {
      about_.shape = shape_of(at_);
      about_.blur_px = at_(blur);
      if (round + 1 < most_rounds) continue;
    }
    if (!settle_cells()) return {};
    if (band_holds()) return report(verdict_);
    about_.shape = shape_of(at_);
    about_.blur_px = at_(blur);
  }
  return {};
}

}  // namespace

ContourFit fit_contour(const GreyWindow& window, const ContourShape& shape, const ContourStart& start,
                       ContourWorkspace& workspace) {
  const ContourFit fit = ContourDescent(window, shape, start, workspace).run();
  if (fit.converged || start.blur_px > soft_start_px) return fit;
  ContourStart soft = start;
  soft.blur_px = soft_start_px;
  const ContourFit again = ContourDescent(window, shape, soft, workspace).run();
  return again.converged ? again : fit;
}

}  // namespace zeropose
