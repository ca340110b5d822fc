// What must fit together inside a cell file, beyond the single keys.
#pragma once

#include <span>
#include <vector>

#include "config/cell.h"
#include "config/json_reader.h"

namespace zeropose {

// Names, numbers and addresses used twice, requirements that the marks cannot fulfil, deadlines. Values that
// could not be read are left out.
void check_cell(const Cell& cell, JsonReading& reading);

// Gives reference points that were taught as a pixel a place on its line of sight, and complains about points
// that lie outside the picture of a camera that should see them. Precondition: the calibration is complete.
void put_references_in_place(Cell& cell, JsonReading& reading);

// The calibration of each camera of the cell, in the cell's order. Mistakes: a camera without calibration, of
// another image size, with a pose of the wrong kind (in the world or on a hand), with a lens model that does
// not reach its corners.
std::vector<CalibratedCamera> calibration_in_order(const Cell& cell,
                                                   std::span<const CalibratedCamera> calibrated,
                                                   JsonReading& reading);

}  // namespace zeropose
