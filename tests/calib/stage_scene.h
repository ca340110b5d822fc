// A stereo sensor that is calibrated with a glass board on a stage: 5 x 5 marks, 6 mm lenses, 220 mm away.
#pragma once

#include "views_scene.h"

namespace zeropose::test {

inline std::vector<Pose> stage_steps(int count = 7, double step_mm = 6) {
  std::vector<Pose> steps;
  for (int k = 0; k < count; ++k) steps.push_back(from_six_numbers({0, 0, step_mm * k, 0, 0, 0}));
  return steps;
}

// The stage makes `steps`, the first one none, in its axes; the table takes them for steps of the board,
// which sits on it by X_BS^-1. The board's first position is W; the first camera stands left of it, a second
// one right.
inline ViewsScene stage_scene(std::size_t cameras, const Pose& X_BS,
                              const std::vector<Pose>& steps = stage_steps(),
                              const Distortion& lens = Division{-0.15}) {
  const CameraModel left{1280, 1024, 1251.3, 1249.2, 645.3, 498.1, lens};
  const CameraModel right{1280, 1024, 1247.8, 1249.9, 631.0, 520.4, lens};
  const std::vector<Pose> X_WC{from_six_numbers({-60, 2, -212, 1, 15.5, 0.5}),
                               from_six_numbers({58, -3, -214, -1.5, -15, -0.4})};
  std::vector<Eigen::Vector3d> points;
  for (int row = -2; row <= 2; ++row)
    for (int col = -2; col <= 2; ++col) points.emplace_back(35 * col, 35 * row, 0);
  std::vector<Pose> X_WB;
  for (const Pose& X_S1S : steps) X_WB.push_back(X_BS * X_S1S * X_BS.inverse());
  const auto count = static_cast<std::ptrdiff_t>(cameras);
  const std::vector<CameraModel> models{left, right};
  ViewsScene scene =
      scene_at({models.begin(), models.begin() + count}, {X_WC.begin(), X_WC.begin() + count}, points, X_WB);
  for (std::size_t v = 0; v < steps.size(); ++v) scene.views[v].X_WB = steps[v];
  return scene;
}

}  // namespace zeropose::test
