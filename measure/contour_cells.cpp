#include "measure/contour_cells.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "measure/contour_model.h"

namespace zeropose::contour {
namespace {

// Outer ends of the layers beyond the core: thin ones first, so that a neighbour costs little.
constexpr std::array<float, side_layers> layer_ends_px{1, 2.5F, 5.5F, 9.5F};
constexpr double least_pixels = 6;         // of a stretch that counts
constexpr double plain_core_share = 0.04;  // of the contrast: model errors across the outline, rms
constexpr double plain_flat_share = 0.01;  // and beside it
constexpr double sigmas = 4.5;

// -1: beyond all. Precondition: beyond the core.
int layer_of(float distance, float core) {
  const float beyond = std::abs(distance) - core;
  for (int k = 0; k < side_layers; ++k) {
    if (beyond <= layer_ends_px[std::size_t(k)]) return k + (distance > 0 ? 0 : side_layers);
  }
  return -1;
}

// Across the outline, of one stretch.
struct CoreSums {
  double n = 0, rr = 0, rs = 0, ss = 0;  // residual, slope

  double variance() const { return rr / std::max(1.0, n); }
  double displacement_px() const { return ss > 0 ? rs / ss : 0; }
};
using Cores = std::vector<CoreSums>;

Cores sums_of(const PixelBand& band, const PixelResiduals& residuals, int stretches) {
  Cores cores(static_cast<std::size_t>(stretches));
  for (std::size_t i = 0; i < band.size(); ++i) {
    CoreSums& core = cores[std::size_t(band.stretch[i])];
    const double r = residuals.residual[i], s = residuals.slope[i];
    core.n += 1;
    core.rr += r * r;
    core.rs += r * s;
    core.ss += s * s;
  }
  return cores;
}

double median_variance(const Cores& cores) {
  std::vector<double> variances;
  for (const CoreSums& core : cores) {
    if (core.n >= least_pixels) variances.push_back(core.variance());
  }
  if (variances.empty()) return 0;
  const auto middle = variances.begin() + std::ptrdiff_t(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  return *middle;
}

bool core_fits(const CoreSums& core, double noise2, double contrast) {
  const double model = plain_core_share * contrast;
  const double displacement2 = core.displacement_px() * core.displacement_px();
  return core.n >= least_pixels &&
         core.variance() < noise2 * (1 + sigmas * std::sqrt(2 / core.n)) + model * model &&
         (core.ss <= 0 ||
          displacement2 < sigmas * sigmas * noise2 / core.ss + contour_rough_px * contour_rough_px);
}

bool flat_fits(const FlatSums& cell, const FlatMisfit& misfit, double noise2, double contrast) {
  if (cell.n < 1) return false;
  const double model = plain_flat_share * contrast;
  return misfit.squares / cell.n < noise2 * (1 + (sigmas + 1) * std::sqrt(2 / cell.n)) + model * model &&
         std::abs(misfit.mean) < sigmas * std::sqrt(noise2 / cell.n) + model;
}

// A fit pulled away by much that does not belong there fits nowhere: the better half stays.
void keep_half(const Cores& cores, std::vector<bool>& used) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (cores[k].n >= least_pixels) order.push_back(k);
  }
  const auto kept = std::size_t(std::count(used.begin(), used.end(), true));
  if (2 * kept >= order.size()) return;
  std::stable_sort(order.begin(), order.end(), [&cores](std::size_t a, std::size_t b) {
    return cores[a].variance() < cores[b].variance();
  });
  for (std::size_t k = 0; k < order.size(); ++k) used[order[k]] = k < (order.size() + 1) / 2;
}

// How many layers of one side of a stretch, from the core outwards, fit; the last one before something else
// begins is left out as well, for that reaches into it with its blur.
int fitting_layers(const PixelBand& band, const Unknowns& at, std::size_t first, double noise2) {
  const double contrast = std::abs(at(background) - at(mark));
  for (int k = 0; k < side_layers; ++k) {
    const std::size_t cell = first + std::size_t(k);
    if (band.flat[cell].n < 1) return k;
    const FlatMisfit misfit =
        flat_misfit(band.flat[cell], shows_background(cell) ? at(background) : at(mark), at);
    if (!flat_fits(band.flat[cell], misfit, noise2, contrast)) return std::max(0, k - 1);
  }
  return side_layers;
}

void use_flat_cells(const PixelBand& band, const Unknowns& at, double noise2, CellVerdict& verdict) {
  double squares = 0, count = 0;
  for (std::size_t first = 0; first < band.flat.size(); first += std::size_t(side_layers)) {
    if (!verdict.stretch_used[first / std::size_t(layers)]) continue;
    const double level = shows_background(first) ? at(background) : at(mark);
    const int fitting = fitting_layers(band, at, first, noise2);
    for (std::size_t cell = first; cell < first + std::size_t(fitting); ++cell) {
      verdict.cell_used[cell] = true;
      squares += flat_misfit(band.flat[cell], level, at).squares;
      count += band.flat[cell].n;
    }
  }
  verdict.flat_rms = count >= 2 * least_pixels ? std::sqrt(squares / count) : 0;
}

void summarise(const Cores& cores, double noise2, CellVerdict& verdict) {
  double seen = 0, used = 0, rr = 0, n = 0, square = 0, weight = 0;
  for (std::size_t k = 0; k < cores.size(); ++k) {
    const CoreSums& core = cores[k];
    seen += core.n >= least_pixels ? 1 : 0;
    if (!verdict.stretch_used[k]) continue;
    used += 1;
    rr += core.rr;
    n += core.n;
    square += core.ss * core.displacement_px() * core.displacement_px();
    weight += core.ss;
  }
  verdict.share = seen > 0 ? used / seen : 0;
  verdict.noise_rms = std::sqrt(noise2);
  if (used == 0 || !(weight > 0)) return;
  verdict.core_rms = std::sqrt(rr / n);
  verdict.outline_px = std::sqrt(square / weight);
  verdict.outline_noise_px = std::sqrt(used * noise2 / weight);
}

// Readies the band's memory.
void clear(const ContourShape& shape, double core_px, PixelBand& band) {
  band.core_px = core_px;
  band.saturated = 0;
  for (auto* column : {&band.grey, &band.x, &band.y}) column->clear();
  band.stretch.clear();
  band.flat.assign(static_cast<std::size_t>(shape.stretches() * layers), FlatSums{});
}

void add_pixel(float grey, float x, float y, const ContourPlace& place, PixelBand& band) {
  const auto core = static_cast<float>(band.core_px);
  if (std::abs(place.distance_px) > core) {
    const int layer = layer_of(place.distance_px, core);
    if (layer >= 0) band.flat[std::size_t(place.stretch * layers + layer)].add(grey, x, y);
    return;
  }
  band.grey.push_back(grey);
  band.x.push_back(x);
  band.y.push_back(y);
  band.stretch.push_back(place.stretch);
  band.saturated += grey > 254.99F ? 1 : 0;
}

}  // namespace

void collect_band(const GreyWindow& window, const ContourShape& shape, const ContourStart& about,
                  std::vector<ContourPlace>& row, PixelBand& band) {
  clear(shape, contour_core_px(about.blur_px), band);
  row.resize(std::size_t(window.width()));
  const double reach_px = band.core_px + double(layer_ends_px.back());
  for (int j = 0; j < window.height(); ++j) {
    const double y = j - about.origin_j;
    const ContourShape::Reach reach = shape.reach_of_row(about.shape, y, reach_px);
    const int from = static_cast<int>(std::clamp(std::ceil(reach.from) + about.origin_i, 0.0, 1e6));
    const int to =
        static_cast<int>(std::clamp(std::floor(reach.to) + about.origin_i, -1.0, double(window.width() - 1)));
    if (to < from) continue;
    const std::span<ContourPlace> places(row.data(), std::size_t(to - from + 1));
    shape.place_row(about.shape, from - about.origin_i, y, places);
    for (int i = from; i <= to; ++i) {
      const ContourPlace& place = places[std::size_t(i - from)];
      if (place.stretch < 0) continue;
      add_pixel(window.at(i, j), static_cast<float>(i - about.origin_i), static_cast<float>(y), place, band);
    }
  }
}

CellVerdict judge_cells(const PixelBand& band, const PixelResiduals& residuals, int stretches,
                        const Unknowns& at, double rounding_variance) {
  const Cores cores = sums_of(band, residuals, stretches);
  const double noise2 = std::max(rounding_variance, median_variance(cores));
  const double contrast = std::abs(at(background) - at(mark));
  CellVerdict verdict;
  verdict.cell_used.resize(band.flat.size());
  for (const CoreSums& core : cores) verdict.stretch_used.push_back(core_fits(core, noise2, contrast));
  keep_half(cores, verdict.stretch_used);
  use_flat_cells(band, at, noise2, verdict);
  summarise(cores, noise2, verdict);
  return verdict;
}

}  // namespace zeropose::contour
