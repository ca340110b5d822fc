#include "measure/pattern_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr float full_weight_sigmas = 2.5F, no_weight_sigmas = 4.5F;
constexpr double cut_variance = 0.9824;  // of normal residuals under these weights
constexpr double rounding_variance = 1.0 / 12;
constexpr double linear_prior = 0.1;  // sigma: holds what a patch of rings leaves open
constexpr double slope_noise_share =
    0.766;  // of the image's noise, interpolated, in what slopes' noise picks up
constexpr double white_grey = 254.999;
constexpr double farthest_start_px = 1e6;
constexpr double longest_step_px = 1.5;
constexpr double least_share = 0.3;  // of the patch, below that there is nothing to match

// Variance of a value between pixels by that of the pixels, at t of the way to the next one (0..1): of the
// cubic spline to 0.003.
double interpolated_noise(double t) {
  const double q = t * (1 - t);
  return 1 + 0.1095 * q - 4.3127 * q * q;
}

Eigen::Map<Eigen::ArrayXf> array_of(std::vector<float>& values) {
  return {values.data(), Eigen::Index(values.size())};
}

Eigen::Map<const Eigen::ArrayXf> array_of(const std::vector<float>& values) {
  return {values.data(), Eigen::Index(values.size())};
}

// What of a field is image.
struct SeenOfField {
  double u0 = 0, v0 = 0, u1 = 0, v1 = 0;  // px
};

// One match under way.
class Match {
 public:
  Match(const PatternLevel& level, GreySpline spline, const GreyField& field, const SeenOfField& seen,
        const PatternWarp& start, double noise_grey)
      : p_(level),
        spline_(std::move(spline)),
        field_(field),
        seen_(seen),
        patch_noise_(noise_grey),
        warp_(start) {
    for (std::vector<float>* part : {&grey_, &valid_, &residual_, &weight_, &weighted_})
      part->assign(p_.size(), 0.0F);
    whole_ = information_of(p_, p_.counts);
    any_white_ = *std::max_element(field_.grey.begin(), field_.grey.end()) >= float(white_grey);
  }

  PatternFit run(const MatchLimits& limits);

 private:
  void sample();
  void sample_row(int j);
  bool row_inside(const Vector2d& from, const Vector2d& to) const;
  bool regress();
  void residuals();
  void find_scale();
  void weigh();
  bool begin();
  MatchMatrix information() const;
  MatchMatrix prior() const;
  double clumping() const;
  void look_again();
  bool step();
  void move(const MatchVector& y);
  void report(PatternFit& fit) const;
  void report_covariance(PatternFit& fit) const;
  double mean_interpolated_noise() const;
  double blur_px2() const;

  const PatternLevel& p_;
  GreySpline spline_;
  const GreyField& field_;
  SeenOfField seen_;
  double patch_noise_;
  PatternWarp warp_;
  std::vector<float> grey_, valid_, residual_, weight_, weighted_, sizes_;
  MatchMatrix whole_;
  bool any_white_ = false;
  double gain_ = 1, offset_ = 0, scale_ = 0, saturated_ = 0, seen_count_ = 0, used_ = 0, last_sigmas_ = 0;
};

bool Match::row_inside(const Vector2d& from, const Vector2d& to) const {
  const Vector2d low = from.cwiseMin(to), high = from.cwiseMax(to);
  return !any_white_ && low.x() >= seen_.u0 && low.y() >= seen_.v0 && high.x() <= seen_.u1 &&
         high.y() <= seen_.v1;
}

void Match::sample_row(int j) {
  const Vector2d first = warp_.middle_px + warp_.linear * Vector2d(-0.5 * (p_.width - 1), p_.down(j));
  const Vector2d along = warp_.linear.col(0);
  const std::size_t begin = std::size_t(j) * std::size_t(p_.stride);
  const auto u0 = float(first.x()), v0 = float(first.y()), du = float(along.x()), dv = float(along.y());
  if (row_inside(first, first + along * (p_.width - 1))) {
    spline_.line(u0, v0, du, dv, p_.width, grey_.data() + begin);
    std::fill_n(valid_.begin() + std::ptrdiff_t(begin), p_.width, 1.0F);
    seen_count_ += p_.width;
    return;
  }
  for (int i = 0; i < p_.width; ++i) {
    const float u = u0 + float(i) * du, v = v0 + float(i) * dv;
    const bool inside =
        double{u} >= seen_.u0 && double{v} >= seen_.v0 && double{u} <= seen_.u1 && double{v} <= seen_.v1;
    const bool white =
        inside && any_white_ &&
        field_.row(static_cast<int>(v + 0.5F))[static_cast<int>(u + 0.5F)] >= float(white_grey);
    grey_[begin + std::size_t(i)] = inside ? spline_.at(u, v) : 0;
    valid_[begin + std::size_t(i)] = inside && !white ? 1 : 0;
    seen_count_ += inside ? 1 : 0;
    saturated_ += white ? 1 : 0;
  }
}

void Match::sample() {
  seen_count_ = saturated_ = 0;
  for (int j = 0; j < p_.height; ++j) sample_row(j);
}

// Gain and offset under the weights.
bool Match::regress() {
  const auto weights = array_of(weight_), image = array_of(grey_);
  const auto patch = array_of(p_.grey);
  const double w = double{weights.sum()}, t = double{(weights * patch).sum()},
               i = double{(weights * image).sum()};
  const double variance = double{(weights * patch.square()).sum()} - t * t / w;
  if (!(w > least_share * p_.area()) || !(variance > 0)) return false;
  gain_ = (double{(weights * patch * image).sum()} - t * i / w) / variance;
  offset_ = (i - gain_ * t) / w;
  return true;
}

void Match::residuals() {
  array_of(residual_) =
      array_of(valid_) * (array_of(grey_) - float(gain_) * array_of(p_.grey) - float(offset_));
}

// Sigma from the middle one of some of the residuals' sizes.
void Match::find_scale() {
  const std::size_t every = std::max<std::size_t>(1, p_.size() / 200) | 1;
  sizes_.clear();
  for (std::size_t k = 0; k < p_.size(); k += every) {
    if (valid_[k] > 0) sizes_.push_back(std::abs(residual_[k]));
  }
  scale_ = std::sqrt(rounding_variance);
  if (sizes_.empty()) return;
  const auto middle = sizes_.begin() + std::ptrdiff_t(sizes_.size() / 2);
  std::nth_element(sizes_.begin(), middle, sizes_.end());
  scale_ = std::max(double{*middle} / 0.6745, std::hypot(gain_ * patch_noise_, scale_));
}

void Match::weigh() {
  const auto by_scale = float(1 / (scale_ * double{no_weight_sigmas - full_weight_sigmas}));
  constexpr float from = no_weight_sigmas / (no_weight_sigmas - full_weight_sigmas);
  array_of(weight_) = array_of(valid_) * (from - by_scale * array_of(residual_).abs()).max(0.0F).min(1.0F);
  used_ = double{array_of(weight_).sum()};
}

// Gain and offset from scratch, without what is covered.
bool Match::begin() {
  sample();
  weight_ = valid_;
  for (int round = 0; round < 2; ++round) {
    if (!regress()) return false;
    residuals();
    find_scale();
    weigh();
  }
  return gain_ > 0;
}

MatchMatrix Match::prior() const {
  MatchMatrix R = MatchMatrix::Zero();
  const double weight = std::pow(scale_ / (linear_prior * gain_), 2);
  for (int k = 2; k < 6; ++k) R(k, k) = weight;
  return R;
}

void Match::move(const MatchVector& y) {
  Vector2d shift = y.head<2>() / gain_;
  Matrix2d linear;
  linear << y(2), y(3), y(4), y(5);
  linear /= gain_;
  const double reach = shift.norm() + linear.norm() * 0.5 * std::hypot(p_.width, p_.height);
  const double cut = std::min(1.0, longest_step_px / std::max(reach, 1e-12));
  shift *= cut;
  linear *= cut;
  warp_.linear = warp_.linear * (Matrix2d::Identity() + linear).inverse();
  warp_.middle_px -= warp_.linear * shift;
  if (cut == 1) gain_ += y(6), offset_ += y(7);
}

// Of the pixels in use; a few that the weights take out everywhere scale it, no more.
MatchMatrix Match::information() const {
  const double share = used_ / p_.area();
  return share < 0.97 ? information_of(p_, weight_) : MatchMatrix(share * whole_);
}

// False: cannot go on.
bool Match::step() {
  if (!(gain_ > 0) || used_ < least_share * p_.area()) return false;
  array_of(weighted_) = array_of(weight_) * array_of(residual_);
  const MatchMatrix N = information() + prior();
  const SmallCholesky<match_unknowns> solver(N);
  if (!solver.ok()) return false;
  const MatchVector y = solver.solve(gradient_of(p_, weighted_));
  last_sigmas_ = std::sqrt(std::max(0.0, y.dot(N * y))) / scale_;
  move(y);
  return warp_.middle_px.allFinite() && warp_.linear.determinant() > 0.1;
}

PatternFit Match::run(const MatchLimits& limits) {
  PatternFit fit;
  const Vector2d from = warp_.middle_px;
  bool going = begin();
  while (going && !fit.converged && fit.iterations < limits.most_iterations) {
    if (fit.iterations++ > 0) look_again();
    going = step() && (warp_.middle_px - from).norm() <= limits.farthest_px;
    fit.converged = going && last_sigmas_ <= limits.last_step_sigmas;
  }
  report(fit);
  return fit;
}

void Match::look_again() {
  sample();
  residuals();
  if (last_sigmas_ > 0.5) find_scale();  // then it stays, so that the weights come to rest
  weigh();
}

// Over the phases of some of the samples.
double Match::mean_interpolated_noise() const {
  double sum = 0, count = 0;
  for (int j = 0; j < p_.height; j += 3) {
    for (int i = 0; i < p_.width; i += 3) {
      const Vector2d at = warp_.middle_px + warp_.linear * Vector2d(i - 0.5 * (p_.width - 1), p_.down(j));
      sum +=
          interpolated_noise(at.x() - std::floor(at.x())) * interpolated_noise(at.y() - std::floor(at.y()));
      ++count;
    }
  }
  return sum / count;
}

// By how much residuals that go together over neighbours, as blur and other misfit leave them, widen the
// variance: (1 + r) / (1 - r) each way, as for a chain of correlation r. Interpolated noise has up to 0.1 of
// it.
double Match::clumping() const {
  const std::ptrdiff_t s = p_.stride;
  double along_u = 0, along_v = 0, squares = 0;
  for (int j = 0; j + 1 < p_.height; ++j) {
    for (int i = 0; i + 1 < p_.width; ++i) {
      const std::size_t k = std::size_t(j * s + i);
      const double here = double{weight_[k] * residual_[k]};
      squares += here * here;
      along_u += here * double{weight_[k + 1] * residual_[k + 1]};
      along_v += here * double{weight_[k + std::size_t(s)] * residual_[k + std::size_t(s)]};
    }
  }
  const auto widening = [squares](double products) {
    const double r = std::clamp(products / std::max(squares, 1e-9) - 0.1, 0.0, 0.9);
    return (1 + r) / (1 - r);
  };
  return widening(along_u) * widening(along_v);
}

// Residuals are the noise of the image, less what interpolation smooths away, and that of the patch.
// Smoothing takes the fine part of the noise, which hardly moves the place: in the covariance it counts in
// full.
void Match::report_covariance(PatternFit& fit) const {
  const double image_variance = fit.noise_grey * fit.noise_grey, patch_variance = patch_noise_ * patch_noise_;
  const double variance = image_variance + gain_ * gain_ * patch_variance, share = used_ / p_.area();
  const MatchMatrix of_noise = share * patch_variance * slope_noise_of(p_),
                    signal = information() + prior() - of_noise;
  const SmallCholesky<match_unknowns> solver(signal);
  if (!solver.ok()) {
    fit.converged = false;
    return;
  }
  const MatchMatrix K = solver.inverse();
  fit.covariance = clumping() * K * (variance * signal + slope_noise_share * image_variance * of_noise) * K;
  fit.covariance.topRows<6>() /= gain_;
  fit.covariance.leftCols<6>() /= gain_;
  fit.converged = fit.converged && fit.covariance.allFinite();
}

// The residuals' part that goes with the patch's second derivative, as blur (heat equation): first order,
// good enough to tell why a match is poor. The patch's own noise is in both and taken off.
double Match::blur_px2() const {
  const std::ptrdiff_t s = p_.stride;
  double with_residual = 0, squares = 0, count = 0;
  for (int j = 1; j + 1 < p_.height; ++j) {
    for (int i = 1; i + 1 < p_.width; ++i) {
      const std::ptrdiff_t k = j * s + i;
      const float* const t = p_.grey.data() + k;
      const double w = double{weight_[std::size_t(k)]};
      const double half = 0.5 * gain_ * double{t[-1] + t[1] + t[-s] + t[s] - 4 * t[0]};
      with_residual += w * half * double{residual_[std::size_t(k)]};
      squares += w * half * half;
      count += w;
    }
  }
  const double noise = count * std::pow(gain_ * patch_noise_, 2);
  const double signal = squares - 5 * noise;  // 20 / 4
  return signal > 0.2 * squares ? (with_residual - 2 * noise) / signal : 0;
}

void Match::report(PatternFit& fit) const {
  fit.warp = warp_;
  fit.gain = gain_;
  fit.offset_grey = offset_ - gain_ * p_.mean_grey;
  fit.used_share = used_ / p_.area();
  fit.seen_share = seen_count_ / p_.area();
  fit.saturated_share = saturated_ / p_.area();
  double w = 0, t = 0, tt = 0, rr = 0;
  for (std::size_t k = 0; k < p_.size(); ++k) {
    const double weight = double{weight_[k]}, patch = double{p_.grey[k]}, residual = double{residual_[k]};
    w += weight, t += weight * patch, tt += weight * patch * patch, rr += weight * residual * residual;
  }
  if (!(w > match_unknowns)) {
    fit.converged = false;
    return;
  }
  const double explained = gain_ * gain_ * (tt - t * t / w);
  fit.correlation = explained + rr > 0 ? std::copysign(std::sqrt(explained / (explained + rr)), gain_) : 0;
  const double residual_variance = rr / (w - match_unknowns) / cut_variance;
  const double of_image = residual_variance - std::pow(gain_ * patch_noise_, 2);
  fit.noise_grey = std::sqrt(std::max(of_image / mean_interpolated_noise(), rounding_variance));
  fit.blur_px2 = blur_px2();
  if (fit.converged) report_covariance(fit);
}

PixelWindow window_about(const PatternWarp& warp, const PatternLevel& level, double margin_px) {
  const Vector2d half =
      0.5 * (warp.linear.cwiseAbs() * Vector2d(level.width, level.height)) + Vector2d::Constant(margin_px);
  const Vector2d low = (warp.middle_px - half).array().floor(), high = (warp.middle_px + half).array().ceil();
  return {static_cast<int>(low.x()), static_cast<int>(low.y()), static_cast<int>(high.x()),
          static_cast<int>(high.y())};
}

// In the part about the start of what is width x height large. part_at: the greys of a window.
template <typename PartAt>
PatternFit match_in(const PatternLevel& level, int width, int height, const PartAt& part_at,
                    const PatternWarp& start, double noise_grey, const MatchLimits& limits) {
  if (!start.middle_px.allFinite() || !start.linear.allFinite() ||
      start.middle_px.cwiseAbs().maxCoeff() > farthest_start_px) {
    return {};
  }
  const double turning = 0.06 * 0.5 * std::hypot(level.width, level.height);
  const PixelWindow window = window_about(start, level, limits.farthest_px + turning + 1);
  if (window.u1 < 0 || window.v1 < 0 || window.u0 >= width || window.v0 >= height) return {};
  const Vector2d origin(window.u0, window.v0);
  const SeenOfField seen{std::max(0.0, -origin.x()), std::max(0.0, -origin.y()),
                         std::min(window.u1, width - 1) - origin.x(),
                         std::min(window.v1, height - 1) - origin.y()};
  PatternWarp here = start;
  here.middle_px -= origin;
  const GreyField field = part_at(window);
  PatternFit fit = Match(level, GreySpline(field), field, seen, here, noise_grey).run(limits);
  fit.warp.middle_px += origin;
  return fit;
}

}  // namespace

PatternFit match_level(const PatternLevel& level, const GreyField& field, const PatternWarp& start,
                       double noise_grey, const MatchLimits& limits) {
  const auto part = [&field](const PixelWindow& window) { return part_of(field, window); };
  return match_in(level, field.width, field.height, part, start, noise_grey, limits);
}

PatternFit fit_pattern(const ImageView& image, const Pattern& pattern, const PatternLevel& level,
                       const PatternWarp& start, const MatchLimits& limits) {
  const auto part = [&image](const PixelWindow& window) { return field_of(image, window); };
  return match_in(level, image.width_px, image.height_px, part, start, pattern.noise_grey, limits);
}

}  // namespace zeropose
