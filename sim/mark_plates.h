// Round marks on plates: those of a car body, and the reference points of every cell.
#pragma once

#include <string>
#include <vector>

#include "sim/look.h"
#include "sim/random.h"

namespace zeropose {

// A mark on the object (a reference point: in the world), on its plate. The plate is flat, of one grey and
// free of everything for at least 16 mm round the mark.
struct MarkPlate {
  std::string name;
  Pose X_OM = Pose::Identity();  // M: origin in the mark's centre, z its normal
  double radius_mm = 0;
  double mark_grey = 0;
  std::vector<Thing> things;  // the plate and what is fixed to it, in M
  std::vector<Thing> cover;   // what hides the mark, in M
};

// X_CO: where the camera sees the object now; it says which way is right on the plate, and how a mark of
// unknown normal lies. Throws std::invalid_argument for marks that are no discs.
MarkPlate make_plate(const Mark& mark, const Pose& X_CO, const PictureSettings& picture, Random& random);

double plate_reach_mm(const MarkPlate& plate);

// What hides a mark of this size, of a grey of its own, in M.
std::vector<Thing> cover_things(double radius_mm, double grey, Random& random);

// The reference points that a camera sees, in W instead of O; nearer than the object.
std::vector<MarkPlate> reference_plates(const Scene& scene, std::size_t camera);

// X_CF: of the frame that the plate is in.
void paint_plate(Canvas& canvas, const MarkPlate& plate, const Pose& X_CF, const Moment& moment);

}  // namespace zeropose
