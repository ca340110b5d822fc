// The tables of the batch commands: marks, observations and point pairs (spec 92).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calib/best_fit.h"
#include "config/config_error.h"
#include "measure/job.h"
#include "measure/pose.h"

namespace zeropose {

// Columns mark x_mm y_mm z_mm [weight tolerance_px tolerance_mm sigma_mm]. All throw ConfigError with every
// mistake.
std::vector<Mark> load_marks(const std::filesystem::path& path);

// Columns camera mark u_px v_px [suu svv suv]; the last three, the covariance in px^2, all or none. Without
// them the covariance is the identity: one pixel.
std::vector<Observation> load_observations(const std::filesystem::path& path,
                                           std::span<const CalibratedCamera> cameras,
                                           std::span<const Mark> marks);

// Columns camera point u_px v_px [suu svv suv] as those of marks. Observation::mark is the index into the
// points, which are in the order in which they first appear.
struct PointObservations {
  std::vector<std::string> points;
  std::vector<Observation> observations;
};
PointObservations load_point_observations(const std::filesystem::path& path,
                                          std::span<const CalibratedCamera> cameras);

// Columns xa ya za xb yb zb [weight], mm.
std::vector<PointPair> load_point_pairs(const std::filesystem::path& path);

// What a pose is estimated from. A PoseProblem borrows it.
struct PoseInput {
  std::vector<CalibratedCamera> cameras;
  std::vector<Mark> marks;
  std::vector<Observation> observations;
};

// The mistakes of cameras and marks are named together; observations are read once both are right.
PoseInput load_pose_input(const std::filesystem::path& cameras, const std::filesystem::path& marks,
                          const std::filesystem::path& observations);

}  // namespace zeropose
