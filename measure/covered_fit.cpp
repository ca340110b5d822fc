#include "measure/covered_fit.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

namespace zeropose {
namespace {

constexpr int sectors = SectorOf::count;
constexpr double least_share = 0.45;      // of the outline, to go on at all
constexpr double brightest_grey = 254.5;  // not yet white
constexpr double rough_sector_px = 0.2;   // where one sector of a true outline may lie off the ellipse
constexpr int most_rounds = 12, freely = 5;

// The outline with what is known of its blur.
struct Shape {
  EllipseFit fit;
  BlurShape blur;
};

// What the pixels of one sector say about the fitted model.
struct Sector {
  double n = 0, squares = 0;
  int white = 0;          // pixels that stand at white
  double rs = 0, ss = 0;  // residual times slope across the outline, slope squared
  double rms() const { return n > 0 ? std::sqrt(squares / n) : 0; }
  double displacement_px() const { return ss > 0 ? rs / ss : 0; }
};

// Normal equations of the blur's shape.
struct BlurEquations {
  Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
};

struct Residuals {
  std::array<Sector, sectors> sector;
  BlurEquations blur;
};

OutlineSectors grown(OutlineSectors set) { return set | std::rotl(set, 1) | std::rotr(set, 1); }

int gaps_of(OutlineSectors hidden) { return std::popcount(hidden & ~std::rotl(hidden, 1)); }

// One pixel against the model.
struct Compared {
  double residual, slope, by_sharpness;
  Eigen::Vector2d double_angle;  // cos 2a, sin 2a of the direction across the outline
};

Compared compare(const Shape& shape, const Eigen::Matrix2d& P, const Eigen::Vector2d& x, double grey) {
  const EllipseFit& fit = shape.fit;
  const Eigen::Vector2d w = P * x;
  const double rho = std::sqrt(std::max(1e-6, x.dot(w))), size = w.norm() + 1e-9;
  const double d = (rho * rho - rho) / size;
  const Eigen::Vector2d n = w / size;
  const Eigen::Vector2d twice(n.x() * n.x() - n.y() * n.y(), 2 * n.x() * n.y());
  const double sharp = (1 + shape.blur.c * twice.x() + shape.blur.s * twice.y()) / fit.blur_px;
  const double light = 1 + fit.shading_per_px.dot(x), step = fit.background_grey - fit.mark_grey;
  const double below = 0.5 * std::erfc(-d * sharp / std::numbers::sqrt2);
  const double density = std::exp(-0.5 * d * d * sharp * sharp) / std::sqrt(2 * std::numbers::pi);
  return {grey - light * (fit.mark_grey + step * below), -light * step * density * sharp,
          light * step * density * d / fit.blur_px, twice};
}

// Over the whole outline; the blur's equations over what is not hidden.
Residuals residuals_of(const EllipseBand& band, const Shape& shape, OutlineSectors hidden) {
  Residuals result;
  const Eigen::Matrix2d P = shape.fit.shape_px2.inverse();
  const SectorOf sector_of(shape.fit.shape_px2);
  const Eigen::Vector2d centre = shape.fit.centre_px - Eigen::Vector2d(band.origin_u, band.origin_v);
  for (std::size_t i = 0; i < band.size(); ++i) {
    const Eigen::Vector2d x = Eigen::Vector2d(double{band.x[i]}, double{band.y[i]}) - centre;
    const Compared at = compare(shape, P, x, double{band.grey[i]});
    const int k = sector_of(x.x(), x.y());
    Sector& sector = result.sector[std::size_t(k)];
    ++sector.n;
    sector.white += band.grey[i] > brightest_grey ? 1 : 0;
    sector.squares += at.residual * at.residual;
    sector.rs += at.residual * at.slope;
    sector.ss += at.slope * at.slope;
    if ((hidden >> k & 1) != 0) continue;
    const Eigen::Vector2d by_shape = at.by_sharpness * at.double_angle;
    result.blur.N += by_shape * by_shape.transpose();
    result.blur.g += by_shape * at.residual;
  }
  return result;
}

// Of the quiet half of the sectors used.
double noise_of(const Residuals& residuals, OutlineSectors hidden) {
  std::vector<double> rms;
  for (int k = 0; k < sectors; ++k)
    if ((hidden >> k & 1) == 0 && residuals.sector[std::size_t(k)].n > 0)
      rms.push_back(residuals.sector[std::size_t(k)].rms());
  if (rms.empty()) return 0;
  const auto middle = rms.begin() + std::ptrdiff_t(rms.size() / 2);
  std::nth_element(rms.begin(), middle, rms.end());
  return *middle;
}

bool fits(const Sector& sector, double noise, double model_grey) {
  if (!(sector.n > 0) || !(sector.ss > 0) || sector.white > 0) return false;
  const double allowed2 = noise * noise * (1 + 4 * std::sqrt(2 / sector.n)) + model_grey * model_grey;
  const double sigma_px = noise / std::sqrt(sector.ss);
  return sector.squares / sector.n < allowed2 &&
         std::abs(sector.displacement_px()) < rough_sector_px + 3.5 * sigma_px;
}

OutlineSectors misfits(const Residuals& residuals, double noise, double model_grey) {
  OutlineSectors bad = 0;
  for (int k = 0; k < sectors; ++k)
    if (!fits(residuals.sector[std::size_t(k)], noise, model_grey)) bad |= OutlineSectors{1} << k;
  return bad;
}

// A step of the blur's shape where it means something. False: it stands.
bool improve(BlurShape& shape, const BlurEquations& equations, double noise) {
  if (!(equations.N.determinant() > 0)) return false;
  const Eigen::Vector2d step = equations.N.inverse() * equations.g;
  const double sigmas2 = step.dot(equations.N * step) / std::max(noise * noise, 1e-3);
  if (!(sigmas2 > 25) || step.norm() < 0.02) return false;
  const Eigen::Vector2d wanted = Eigen::Vector2d(shape.c, shape.s) + step;
  const double largest = 0.75;  // sigma up to seven times as large along as across
  const Eigen::Vector2d next =
      wanted.norm() > largest ? Eigen::Vector2d(largest * wanted.normalized()) : wanted;
  if ((next - Eigen::Vector2d(shape.c, shape.s)).norm() < 0.02) return false;
  shape = {next.x(), next.y()};
  return true;
}

// How much the outline goes in and out with 3 to 8 waves round it, as corners make it, beyond what noise
// does.
double waves_of(const Residuals& residuals, OutlineSectors hidden, double noise) {
  double largest = 0;
  for (int waves = 3; waves <= 8; ++waves) {
    Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    for (int k = 0; k < sectors; ++k) {
      if ((hidden >> k & 1) != 0) continue;
      const Sector& sector = residuals.sector[std::size_t(k)];
      const double angle = waves * 2 * std::numbers::pi * (k + 0.5) / sectors;
      const Eigen::Vector2d wave(std::cos(angle), std::sin(angle));
      N += sector.ss * wave * wave.transpose();
      g += sector.rs * wave;
    }
    if (!(N.determinant() > 0)) continue;
    const double amplitude2 = (N.inverse() * g).squaredNorm(),
                 sigma2 = noise * noise * N.inverse().trace() / 2;
    largest = std::max(largest, amplitude2 - 9 * sigma2);
  }
  return std::sqrt(largest);
}

EllipseStart start_from(const EllipseFit& fit, OutlineSectors hidden, double band_px) {
  return {fit.centre_px, fit.shape_px2, fit.mark_grey, fit.background_grey, hidden, band_px};
}

CoveredFit settle(const ImageView& image, const EllipseStart& start, double model_share,
                  EllipseWorkspace& workspace) {
  CoveredFit result;
  result.hidden = grown(start.hidden);
  Shape shape;
  EllipseStart from = start;
  for (int round = 0; round < most_rounds; ++round) {
    from.hidden = result.hidden;
    if (sectors - std::popcount(result.hidden) < least_share * sectors) return {};
    shape.fit = fit_ellipse(image, from, workspace, shape.blur);
    if (!shape.fit.converged) return {};
    // The outline as a whole, the hidden sectors too.
    const double reach = std::max(start.band_px, 3.2 * shape.fit.blur_px);
    if (!collect_band(image, shape.fit.centre_px, shape.fit.shape_px2, reach, 0, workspace.band)) return {};
    const Residuals residuals = residuals_of(workspace.band, shape, result.hidden);
    result.noise_grey = noise_of(residuals, result.hidden);
    const bool blur_moved = improve(shape.blur, residuals.blur, result.noise_grey);
    const double model_grey = model_share * std::abs(shape.fit.background_grey - shape.fit.mark_grey);
    OutlineSectors hidden = grown(misfits(residuals, result.noise_grey, model_grey));
    if (round >= freely) hidden |= result.hidden;  // some would come and go for ever
    const bool same = hidden == result.hidden;
    if (!blur_moved) result.hidden = hidden;
    if (same && !blur_moved) {
      result.fit = shape.fit;
      result.waves_px = waves_of(residuals, hidden, result.noise_grey);
      result.gaps = gaps_of(hidden);
      result.outline_share = double(sectors - std::popcount(hidden)) / sectors;
      return result;
    }
    from = start_from(shape.fit, result.hidden, start.band_px);
  }
  return {};
}

}  // namespace

CoveredFit fit_covered_ellipse(const ImageView& image, const EllipseStart& start, double model_share,
                               EllipseWorkspace& workspace) {
  CoveredFit result = settle(image, start, model_share, workspace);
  if (result.fit.converged || start.hidden != 0) return result;
  // Nothing is known of what is covered: a third of the outline in one place or another.
  constexpr OutlineSectors third = (OutlineSectors{1} << 21) - 1;
  for (int turn = 0; turn < sectors && !result.fit.converged; turn += 8) {
    EllipseStart without = start;
    without.hidden = std::rotl(third, turn);
    result = settle(image, without, model_share, workspace);
  }
  return result;
}

}  // namespace zeropose
