#include "calib/views_start.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/homography.h"
#include "calib/words.h"

namespace zeropose::bundle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Status = CalibrationStatus;

constexpr double close_by = 0.05;  // of the image diagonal: a start with this rms needs no other
constexpr double infinite = std::numeric_limits<double>::infinity();

// Points of one rigid body G as a camera saw them: the board of a view, or all views with known poses (W).
struct Group {
  std::vector<Chunk> chunks;
  bool known = false;
  std::vector<ImagedPoint> pairs;  // px
  BestPlane plane;                 // X_GP
};

std::vector<Vector3d> points_of(const Group& group) {
  std::vector<Vector3d> points;
  for (const ImagedPoint& pair : group.pairs) points.push_back(pair.p_mm);
  return points;
}

std::vector<Group> groups_of(const ViewsProblem& problem, std::span<const Chunk> chunks, std::size_t camera) {
  Group known;
  known.known = true;
  std::vector<Group> groups;
  for (const Chunk& chunk : chunks) {
    if (chunk.camera != camera) continue;
    const auto& X_WB = problem.views[chunk.view].X_WB;
    if (!X_WB && check_chunk(problem, chunk).status != Status::ok) continue;
    Group alone;
    Group& group = X_WB ? known : alone;
    group.chunks.push_back(chunk);
    for (const SeenPoint& point : chunk.points)
      group.pairs.push_back({X_WB.value_or(Pose::Identity()) * point.p_B_mm, point.u_px});
    if (!X_WB) groups.push_back(std::move(alone));
  }
  if (known.pairs.size() >= 4) groups.push_back(std::move(known));
  for (Group& group : groups) group.plane = best_plane(points_of(group));
  return groups;
}

std::vector<ImagedPoint> in_plane(const Group& group) {
  std::vector<ImagedPoint> pairs = group.pairs;
  const Pose X_PG = group.plane.X_GP.inverse();
  for (ImagedPoint& pair : pairs) pair.p_mm = X_PG * pair.p_mm;
  return pairs;
}

// Focal lengths to try, the closed form's first.
std::vector<double> focal_lengths(const CameraModel& model, std::span<const Group> groups) {
  std::vector<Matrix3d> planes;
  std::vector<double> found;
  const Vector2d origin(model.cx_px, model.cy_px);
  for (const Group& group : groups) {
    std::vector<ImagedPoint> pairs = in_plane(group);
    for (ImagedPoint& pair : pairs) pair.u -= origin;
    if (group.plane.flatness() <= flat) {
      if (const auto H = homography(pairs)) planes.push_back(*H);
    } else if (const auto P = projection_matrix(pairs)) {
      if (const auto f = focal_of_projection(*P)) found.push_back(*f);
    }
  }
  std::ranges::sort(found);
  std::vector<double> list;
  if (!found.empty()) list.push_back(found[found.size() / 2]);
  if (const auto f = focal_of_planes(planes)) list.push_back(*f);
  const double size = std::max(model.width_px, model.height_px);
  std::erase_if(list, [size](double f) { return f < 0.1 * size || f > 100 * size; });
  for (const double factor : {1.2, 3.0, 0.6, 8.0}) list.push_back(factor * size);
  return list;
}

// X_CG that fits best: from the plane, and from depth where there is some.
std::optional<Pose> pose_of_group(const CameraModel& model, const Group& group) {
  std::vector<ImagedPoint> rays;
  for (const ImagedPoint& pair : in_plane(group))
    if (const auto direction = ray(model, pair.u)) rays.push_back({pair.p_mm, direction->head<2>()});
  std::optional<Pose> best;
  double least = infinite;
  const auto offer = [&](const std::optional<Pose>& X_CP) {
    if (!X_CP) return;
    const Pose X_CG = *X_CP * group.plane.X_GP.inverse();
    double sum = 0;
    for (const ImagedPoint& pair : group.pairs) {
      const auto u = project(model, X_CG * pair.p_mm);
      sum += u ? (*u - pair.u).squaredNorm() : infinite;
    }
    if (sum < least) best = X_CG, least = sum;
  };
  if (const auto H = homography(rays)) offer(pose_of_plane(*H, rays));
  if (group.plane.flatness() > flat)
    if (const auto P = projection_matrix(rays)) offer(pose_of_projection(*P, rays));
  return best;
}

double square_px(const State& state, std::span<const Chunk> chunks) {
  double sum = 0, count = 0;
  for (const Chunk& chunk : chunks) {
    const Pose X_CB = state.X_WC[chunk.camera].inverse() * state.X_WB[chunk.view];
    for (const SeenPoint& point : chunk.points) {
      const auto u = project(state.models[chunk.camera], X_CB * point.p_B_mm);
      sum += u ? (*u - point.u_px).squaredNorm() : infinite;
      count += 1;
    }
  }
  return sum / count;
}

// Poses of one camera's groups for given internals: X_WC from the known poses or the identity.
bool set_poses(State& state, std::size_t camera, std::span<const Group> groups) {
  const CameraModel& model = state.models[camera];
  for (const Group& group : groups)
    if (group.known) {
      const auto X_CW = pose_of_group(model, group);
      if (!X_CW) return false;
      state.X_WC[camera] = X_CW->inverse();
    }
  for (const Group& group : groups) {
    if (group.known) continue;
    const auto X_CB = pose_of_group(model, group);
    if (!X_CB) return false;
    state.X_WB[group.chunks.front().view] = state.X_WC[camera] * *X_CB;
  }
  return true;
}

Freedom freedom_of_one(const Freedom& freedom, std::size_t camera, bool known) {
  Freedom one = freedom;
  one.stage.reset();  // one camera may not tell
  for (std::size_t c = 0; c < one.cameras.size(); ++c) one.cameras[c] = known && c == camera;
  return one;
}

std::vector<Chunk> chunks_in(std::span<const Group> groups) {
  std::vector<Chunk> chunks;
  for (const Group& group : groups) chunks.insert(chunks.end(), group.chunks.begin(), group.chunks.end());
  return chunks;
}

// One camera by itself: the first focal length that is near, else the one that refines best.
bool start_camera(const ViewsProblem& problem, State& state, std::size_t camera,
                  std::span<const Group> groups, const Freedom& freedom) {
  const std::vector<Chunk> chunks = chunks_in(groups);
  const CameraModel given = state.models[camera];
  const bool has_start = problem.cameras[camera].start.has_value();
  const double diagonal = std::hypot(given.width_px, given.height_px);
  std::optional<State> best;
  double least = infinite;
  for (const double f : has_start ? std::vector{given.fx_px} : focal_lengths(given, groups)) {
    State trial = state;
    if (!has_start) trial.models[camera].fx_px = trial.models[camera].fy_px = f;
    if (!set_poses(trial, camera, groups)) continue;
    const bool enough = has_start || square_px(trial, chunks) < close_by * close_by * diagonal * diagonal;
    if (!enough || problem.cameras.size() > 1)
      refine(trial, chunks, freedom_of_one(freedom, camera, groups.back().known),
             {problem.robust, trial_iterations, {}});
    const double square = square_px(trial, chunks);
    if (square < least) best = trial, least = square;
    if (enough) break;
  }
  if (best) state = *best;
  return best.has_value();
}

struct Seen {
  std::size_t camera, view;
  Pose X_CB;
};

// The camera's pose that agrees best with the others that its views propose.
Pose middle_of(const std::vector<Pose>& poses) {
  const auto strangeness = [&poses](const Pose& X) {
    double sum = 0;
    for (const Pose& Y : poses) {
      const Vector6 d = difference(X, Y);
      sum += d.tail<3>().norm() + d.head<3>().norm() / (1 + X.translation().norm());
    }
    return sum;
  };
  return *std::ranges::min_element(poses, {}, strangeness);
}

// Cameras and views one after the other from those that are placed.
void place(State& state, std::span<const Seen> seen, std::vector<bool>& cameras, std::vector<bool>& views) {
  for (bool moved_on = true; moved_on;) {
    moved_on = false;
    for (const Seen& pose : seen)
      if (cameras[pose.camera] && !views[pose.view]) {
        state.X_WB[pose.view] = state.X_WC[pose.camera] * pose.X_CB;
        views[pose.view] = moved_on = true;
      }
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      std::vector<Pose> proposals;
      for (const Seen& pose : seen)
        if (!cameras[c] && pose.camera == c && views[pose.view])
          proposals.push_back(state.X_WB[pose.view] * pose.X_CB.inverse());
      if (proposals.empty()) continue;
      state.X_WC[c] = middle_of(proposals);
      cameras[c] = moved_on = true;
    }
  }
}

Verdict no_start(const ViewsProblem& problem, std::size_t camera, std::span<const Group> groups) {
  State state = empty_state(problem);
  CameraModel& model = state.models[camera];
  if (!problem.cameras[camera].start) model.fx_px = model.fy_px = 1.2 * model.width_px;
  for (const Group& group : groups)
    if (!pose_of_group(model, group))
      return refused(homography(in_plane(group)) ? Status::behind_camera : Status::collinear,
                     name_of_chunk(problem, group.chunks.front()) +
                         (homography(in_plane(group))
                              ? ": no pose has all points in front of the camera (are coordinates or pixels "
                                "mirrored or interchanged?)"
                              : ": all points, or all but one, lie on a line"));
  return refused(Status::not_converged, "no start found for camera \"" + problem.cameras[camera].name + "\"");
}

}  // namespace

State empty_state(const ViewsProblem& problem) {
  State state;
  for (const ViewsCamera& camera : problem.cameras) {
    CameraModel model;
    if (camera.lens == LensModel::brown) model.distortion = BrownConrady{};
    model.fx_px = model.fy_px = 0;
    model.cx_px = (camera.width_px - 1) / 2.0;
    model.cy_px = (camera.height_px - 1) / 2.0;
    if (camera.start) model = *camera.start;
    if (camera.one_focal && !camera.fixed.has(Parameter::fx) && !camera.fixed.has(Parameter::fy))
      model.fx_px = model.fy_px = std::sqrt(model.fx_px * model.fy_px);
    if (camera.one_focal && camera.fixed.has(Parameter::fx)) model.fy_px = model.fx_px;
    model.width_px = camera.width_px, model.height_px = camera.height_px;
    state.models.push_back(model);
  }
  state.X_WC.assign(problem.cameras.size(), Pose::Identity());
  for (const BoardView& view : problem.views) state.X_WB.push_back(view.X_WB.value_or(Pose::Identity()));
  return state;
}

Start start_of(const ViewsProblem& problem, std::span<const Chunk> chunks, const Freedom& freedom) {
  Start start;
  start.state = empty_state(problem);
  std::vector<bool> cameras(problem.cameras.size()), views;
  for (const BoardView& view : problem.views) views.push_back(view.X_WB.has_value());
  std::vector<Seen> seen;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    State alone = start.state;
    const std::vector<Group> groups = groups_of(problem, chunks, c);
    if (groups.empty() || !start_camera(problem, alone, c, groups, freedom))
      return {no_start(problem, c, groups), {}};
    start.state.models[c] = alone.models[c];
    if (groups.back().known) start.state.X_WC[c] = alone.X_WC[c], cameras[c] = true;
    for (const Group& group : groups)
      if (!group.known) {
        const std::size_t view = group.chunks.front().view;
        seen.push_back({c, view, alone.X_WC[c].inverse() * alone.X_WB[view]});
      }
  }
  const bool any_known = std::ranges::find(views, true) != views.end();
  if (!any_known) cameras.front() = true;
  place(start.state, seen, cameras, views);
  if (std::ranges::find(cameras, false) != cameras.end() || std::ranges::find(views, false) != views.end())
    return {refused(Status::not_determined, "the rig does not hang together by its views"), {}};
  return start;
}

}  // namespace zeropose::bundle
