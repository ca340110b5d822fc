// Pictures of polygons of any form with known truth, made without any code or model of the estimators: the
// coverage by an integral along the exact outline (Green) under a numerically integrated Gaussian lens blur
// and square pixels. And scenes of the marks with straight edges, with their Cramer-Rao bound.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "measure/marks.h"
#include "tests/support/mark_picture.h"

namespace zeropose::test {

struct Polygon {
  std::vector<Eigen::Vector2d> corners_px;  // simple, in either sense
  double grey = 0;
};

// Polygons painted one over the other on a background, times linear shading about the picture's middle.
struct PolygonDrawing {
  int width_px = 0, height_px = 0;
  double background = 160;
  std::vector<Polygon> polygons;
  double blur_sigma_px = 0.7;
  Eigen::Vector2d shading_per_px = Eigen::Vector2d::Zero();
};
Picture paint(const PolygonDrawing& drawing);

// Gaussian noise in grey levels, then counts of two bytes up to white.
struct DeepPixels {
  int width_px = 0, height_px = 0, white = 4095;
  std::vector<std::uint16_t> count;

  ImageView view() const {
    return {reinterpret_cast<const std::uint8_t*>(count.data()), width_px, height_px, 2 * width_px, white};
  }
};
DeepPixels expose_deep(const Picture& picture, int white, double noise_sigma, std::mt19937_64& random);

// A mark with straight edges in the middle of a square picture. Parameters by kind, px and rad:
//  edge: offset and direction of the normal (into the bright side) about the middle; if there is a third one,
//        the dark side is only that wide;
//  corner: tip from the middle (2), directions of the arms, the mark from the first to the second;
//  slot: centre from the middle (2), half axis of a cap along the slot (2), across it (2), half the distance
//        of the caps by the former;
//  cross: centre from the middle (2), directions of the bars, half their width, lengths of the arms: along
//         the first direction, against it, along the second one, against it.
struct ShapeScene {
  MarkKind kind = MarkKind::edge;
  std::vector<double> parameters;
  int side_px = 60;
  double background = 160, mark = 60, blur_px = 0.7;
  Eigen::Vector2d shading_per_px = Eigen::Vector2d::Zero();

  Eigen::Vector2d middle() const { return Eigen::Vector2d::Constant(0.5 * (side_px - 1)); }
  Eigen::Vector2d truth_px() const;  // edge: the point nearest to the middle
};
PolygonDrawing drawing_of(const ShapeScene& scene);
MarkSearch search_of(const ShapeScene& scene);  // the whole picture, directions free, sizes +-20 %

// A scene of the kind with random place and turn; the slot also seen obliquely.
ShapeScene random_scene(MarkKind kind, std::mt19937_64& random);

// Cramer-Rao bound of u_px from the pictures themselves, by central differences in every parameter of the
// scene, blur, both levels and shading: px^2. Edge: across it in (0, 0), the rest 0.
Eigen::Matrix2d bound_of(const ShapeScene& scene, double noise_sigma);

MarkFinding find_shape(const ImageView& image, const MarkSearch& search);

}  // namespace zeropose::test
