// The pixels near an outline, sorted into cells, and which cells the model explains. Internal to the room.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "measure/contour_fit.h"

namespace zeropose::contour {

// Layers of distance beyond the core across the outline: outwards into the background, then into the mark.
inline constexpr int side_layers = 4, layers = 2 * side_layers;

// Whether a flat cell shows the background, or the mark.
inline bool shows_background(std::size_t cell) {
  return cell % std::size_t(layers) < std::size_t(side_layers);
}

// Fills the band (reusing its memory) with the pixels of the window near the outline.
void collect_band(const GreyWindow& window, const ContourShape& shape, const ContourStart& about,
                  std::vector<ContourPlace>& row, PixelBand& band);

struct CellVerdict {
  std::vector<bool> cell_used, stretch_used;                  // cells: stretch by stretch, layer by layer
  double share = 0;                                           // of the stretches with pixels that are used
  double noise_rms = 0;                                       // grey levels: of the usual stretch
  double core_rms = 0, outline_px = 0, outline_noise_px = 0;  // over the stretches that are used
  double flat_rms = 0;                                        // over the flat cells that are used
};

// Precondition: residuals of every pixel across the outline, at the same state.
CellVerdict judge_cells(const PixelBand& band, const PixelResiduals& residuals, int stretches,
                        const Unknowns& at, double rounding_variance);

}  // namespace zeropose::contour
