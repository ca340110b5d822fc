// What calibrate_views() refuses before it computes. Internal to calib.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "calib/views.h"
#include "calib/views_bundle.h"

namespace zeropose::bundle {

struct Verdict {
  CalibrationStatus status = CalibrationStatus::ok;
  std::string reason;
};

inline Verdict refused(CalibrationStatus status, std::string reason) { return {status, std::move(reason)}; }

// Sizes, indices, numbers, options that contradict each other, repeated points.
Verdict check_problem(const ViewsProblem& problem);

// The points by view and camera. Precondition: check_problem() is ok.
std::vector<Chunk> chunks_of(const ViewsProblem& problem);

// The best-fit plane of points of a body G: z = 0 of P, whose origin is in their centroid.
struct BestPlane {
  Pose X_GP = Pose::Identity();
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();  // root mean square along x y z of P, falling
  double flatness() const { return spread[2] / spread[0]; }
};
BestPlane best_plane(std::span<const Eigen::Vector3d> points);
inline constexpr double flat = 0.02;  // a flatness below counts as a plane

// A chunk from which a pose can be found: 4 points that lie on no line, on the board and in the image. A
// verdict other than ok says what is missing.
Verdict check_chunk(const ViewsProblem& problem, const Chunk& chunk);

// Every view and camera has points, enough of them, and the rig hangs together.
Verdict check_chunks(const ViewsProblem& problem, std::span<const Chunk> chunks);

std::string name_of_chunk(const ViewsProblem& problem, const Chunk& chunk);

// The free internals of a camera, and the directions that they are.
std::vector<Parameter> free_internals(const ViewsCamera& camera);
Eigen::MatrixXd directions_of(const ViewsCamera& camera);

}  // namespace zeropose::bundle
