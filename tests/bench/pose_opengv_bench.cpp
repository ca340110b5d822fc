// The pose by OpenGV, the same problems and starts as pose_bench.cpp: its non-linear optimisation and UPnP.
// It minimises angles between rays, so it reaches another cost.
#include <opengv/absolute_pose/NoncentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>

#include "tests/bench/pose_cases.h"

namespace zeropose::bench {
namespace {

struct Rays {
  opengv::bearingVectors_t directions;
  std::vector<int> cameras;
  opengv::points_t points;
  opengv::translations_t eyes;
  opengv::rotations_t rotations;
};

Rays rays_of(const PoseCases& all, const PoseCase& one) {
  Rays rays;
  for (const CalibratedCamera& camera : all.cameras) {
    rays.eyes.push_back(camera.X_WC.translation());
    rays.rotations.push_back(camera.X_WC.linear());
  }
  for (const Observation& observation : one.observations) {
    rays.directions.push_back(ray(all.cameras[observation.camera].model, observation.u_px)->normalized());
    rays.cameras.push_back(static_cast<int>(observation.camera));
    rays.points.push_back(one.marks[observation.mark].p_O_mm);
  }
  return rays;
}

// OpenGV's pose is that of its viewpoint (here the world) in the frame of the points: X_OW.
Pose inverse_of(const opengv::transformation_t& X_OW) {
  Pose pose = Pose::Identity();
  pose.linear() = X_OW.leftCols<3>();
  pose.translation() = X_OW.col(3);
  return pose.inverse();
}

void opengv_nonlinear(benchmark::State& state) {
  const PoseCases all = car_body_cases(false);
  run_poses(state, all, [&](const PoseCase& one) {
    const Rays rays = rays_of(all, one);
    const Pose X_OW = one.X_WO_start.inverse();
    opengv::absolute_pose::NoncentralAbsoluteAdapter adapter(rays.directions, rays.cameras, rays.points,
                                                             rays.eyes, rays.rotations, X_OW.translation(),
                                                             X_OW.linear());
    return inverse_of(opengv::absolute_pose::optimize_nonlinear(adapter));
  });
}

void opengv_upnp(benchmark::State& state) {
  const PoseCases all = car_body_cases(false);
  run_poses(state, all, [&](const PoseCase& one) {
    const Rays rays = rays_of(all, one);
    opengv::absolute_pose::NoncentralAbsoluteAdapter adapter(rays.directions, rays.cameras, rays.points,
                                                             rays.eyes, rays.rotations);
    Pose best = Pose::Identity();
    double least = 1e300;
    for (const auto& candidate : opengv::absolute_pose::upnp(adapter)) {
      const Pose X_WO = inverse_of(candidate);
      if (const double cost = cost_of(all, one, X_WO); cost < least) {
        least = cost;
        best = X_WO;
      }
    }
    return best;
  });
}

BENCHMARK(opengv_nonlinear)->Unit(benchmark::kMicrosecond);
BENCHMARK(opengv_upnp)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace zeropose::bench
