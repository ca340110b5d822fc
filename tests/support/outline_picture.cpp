#include "tests/support/outline_picture.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>

#include "measure/edge_marks.h"

namespace zeropose::test {
namespace {

using Eigen::Vector2d;

constexpr double pi = 3.14159265358979323846;
constexpr double step_px = 1.0 / 12;  // along the outline

// The point spread along one axis, Gauss over a pixel's box, and its running integral by the trapezium rule,
// on a grid of 1/256 px.
class BoxedGauss {
 public:
  explicit BoxedGauss(double sigma) : reach_(4.7 * sigma + 0.5), half_(int(std::ceil(reach_ * steps_))) {
    const auto below = [sigma](double x) { return 0.5 * std::erfc(-x / (sigma * std::sqrt(2.0))); };
    for (int i = -half_; i <= half_; ++i) {
      const double x = double(i) / steps_;
      density_.push_back(below(x + 0.5) - below(x - 0.5));
      const double last = integral_.empty() ? 0 : integral_.back();
      const double before = density_.size() < 2 ? 0 : density_[density_.size() - 2];
      integral_.push_back(last + 0.5 * (before + density_.back()) / steps_);
    }
    for (double& value : integral_) value /= integral_.back();
  }

  double reach() const { return reach_; }
  double density(double x) const { return at(density_, x, 0); }
  double integral(double x) const { return at(integral_, x, 1); }

 private:
  double at(const std::vector<double>& table, double x, double above) const {
    const double place = x * steps_ + half_;
    if (place <= 0) return 0;
    if (place >= 2.0 * half_) return above;
    const auto i = static_cast<std::size_t>(place);
    const double part = place - double(i);
    return table[i] * (1 - part) + table[i + 1] * part;
  }

  static constexpr int steps_ = 256;
  double reach_;
  int half_;
  std::vector<double> density_, integral_;
};

struct Cover {
  int width, height;
  std::vector<double> share;
};

// A piece of the outline at (x, y) that rises by dy: all pixels to its right in reach of its row.
void add_piece(const Vector2d& at, double dy, const BoxedGauss& spread, Cover& cover) {
  const int first = std::max(0, int(std::ceil(at.y() - spread.reach())));
  const int last = std::min(cover.height - 1, int(std::floor(at.y() + spread.reach())));
  const int near = std::max(0, int(std::ceil(at.x() - spread.reach())));
  for (int v = first; v <= last; ++v) {
    const double weight = spread.density(v - at.y()) * dy;
    double* row = cover.share.data() + std::ptrdiff_t{v} * cover.width;
    for (int u = near; u < cover.width; ++u) row[u] += weight * spread.integral(u - at.x());
  }
}

Cover cover_of(const Polygon& polygon, const PolygonDrawing& drawing, const BoxedGauss& spread) {
  Cover cover{drawing.width_px, drawing.height_px, {}};
  cover.share.assign(std::size_t(cover.width) * std::size_t(cover.height), 0.0);
  double area = 0;
  const std::size_t n = polygon.corners_px.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Vector2d &p = polygon.corners_px[k], &q = polygon.corners_px[(k + 1) % n];
    area += 0.5 * (p.x() * q.y() - p.y() * q.x());
    const int pieces = std::max(1, int(std::ceil((q - p).norm() / step_px)));
    for (int i = 0; i < pieces; ++i) {
      add_piece(p + (i + 0.5) / pieces * (q - p), (q.y() - p.y()) / pieces, spread, cover);
    }
  }
  for (double& share : cover.share) share *= area > 0 ? -1 : 1;
  return cover;
}

Vector2d unit(double angle) { return {std::cos(angle), std::sin(angle)}; }

double between(double low, double high, std::mt19937_64& random) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Polygon edge_of(const ShapeScene& s) {
  const double far = 2 * s.side_px;
  const Vector2d n = unit(s.parameters[1]), t(-n.y(), n.x()), on = s.middle() + s.parameters[0] * n;
  const double deep = s.parameters.size() > 2 ? s.parameters[2] : far;
  return {{on + far * t, on - far * t, on - far * t - deep * n, on + far * t - deep * n}, s.mark};
}

Polygon corner_of(const ShapeScene& s) {
  const double far = 2 * s.side_px;
  const Vector2d tip = s.middle() + Vector2d(s.parameters[0], s.parameters[1]);
  const Vector2d a = far * unit(s.parameters[2]), b = far * unit(s.parameters[3]);
  return {{tip, tip + a, tip + a + b, tip + b}, s.mark};
}

Polygon slot_of(const ShapeScene& s) {
  const auto& p = s.parameters;
  const Vector2d centre = s.middle() + Vector2d(p[0], p[1]), along(p[2], p[3]), across(p[4], p[5]);
  constexpr int pieces = 240;
  Polygon slot{{}, s.mark};
  for (int k = 0; k <= pieces; ++k) {
    const double t = pi * k / pieces - pi / 2;
    slot.corners_px.push_back(centre + (p[6] + std::cos(t)) * along + std::sin(t) * across);
  }
  for (int k = 0; k <= pieces; ++k) {
    slot.corners_px.push_back(2 * centre - slot.corners_px[std::size_t(k)]);
  }
  return slot;
}

// Twelve corners: ends of the four arms and where the bars' edges meet.
Polygon cross_of(const ShapeScene& s) {
  const auto& p = s.parameters;
  const Vector2d centre = s.middle() + Vector2d(p[0], p[1]), a = unit(p[2]), b = unit(p[3]);
  const Vector2d na(-a.y(), a.x()), nb(-b.y(), b.x());
  const double sine = std::abs(a.x() * b.y() - a.y() * b.x()), w = p[4];
  const Vector2d in_a = w / sine * a, in_b = w / sine * b;
  const Vector2d wa = a.x() * b.y() - a.y() * b.x() > 0 ? w * na : Vector2d(-w * na),
                 wb = a.x() * b.y() - a.y() * b.x() > 0 ? Vector2d(-w * nb) : w * nb;
  const Vector2d A = p[5] * a, C = -p[6] * a, B = p[7] * b, D = -p[8] * b;
  std::vector<Vector2d> c{A - wa, A + wa, in_a + in_b,  B + wb, B - wb, in_b - in_a,
                          C + wa, C - wa, -in_a - in_b, D - wb, D + wb, in_a - in_b};
  for (Vector2d& corner : c) corner += centre;
  return {c, s.mark};
}

// Scenes next to a scene in each of its unknowns.
std::vector<std::function<void(ShapeScene&, double)>> changes_of(const ShapeScene& scene) {
  std::vector<std::function<void(ShapeScene&, double)>> changes;
  for (std::size_t k = 0; k < scene.parameters.size(); ++k) {
    changes.push_back([k](ShapeScene& s, double h) { s.parameters[k] += h; });
  }
  changes.push_back([](ShapeScene& s, double h) { s.blur_px += h; });
  changes.push_back([](ShapeScene& s, double h) { s.background += 100 * h; });
  changes.push_back([](ShapeScene& s, double h) { s.mark += 100 * h; });
  changes.push_back([](ShapeScene& s, double h) { s.shading_per_px.x() += 0.01 * h; });
  changes.push_back([](ShapeScene& s, double h) { s.shading_per_px.y() += 0.01 * h; });
  return changes;
}

}  // namespace

Picture paint(const PolygonDrawing& drawing) {
  Picture picture{drawing.width_px, drawing.height_px, {}};
  picture.grey.assign(std::size_t(drawing.width_px) * std::size_t(drawing.height_px), drawing.background);
  const BoxedGauss spread(drawing.blur_sigma_px);
  for (const Polygon& polygon : drawing.polygons) {
    const Cover cover = cover_of(polygon, drawing, spread);
    for (std::size_t i = 0; i < cover.share.size(); ++i) {
      picture.grey[i] += cover.share[i] * (polygon.grey - picture.grey[i]);
    }
  }
  for (int v = 0; v < drawing.height_px; ++v) {
    for (int u = 0; u < drawing.width_px; ++u) {
      const Vector2d off(u - 0.5 * (drawing.width_px - 1), v - 0.5 * (drawing.height_px - 1));
      picture.grey[std::size_t(v * drawing.width_px + u)] *= 1 + drawing.shading_per_px.dot(off);
    }
  }
  return picture;
}

DeepPixels expose_deep(const Picture& picture, int white, double noise_sigma, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  DeepPixels pixels{picture.width_px, picture.height_px, white, {}};
  for (const double grey : picture.grey) {
    const double value = white / 255.0 * (noise_sigma > 0 ? grey + noise_sigma * normal(random) : grey);
    pixels.count.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0, double(white)))));
  }
  return pixels;
}

Vector2d ShapeScene::truth_px() const {
  if (kind == MarkKind::edge) return middle() + parameters[0] * unit(parameters[1]);
  return middle() + Vector2d(parameters[0], parameters[1]);
}

PolygonDrawing drawing_of(const ShapeScene& scene) {
  PolygonDrawing drawing;
  drawing.width_px = drawing.height_px = scene.side_px;
  drawing.background = scene.background;
  drawing.blur_sigma_px = scene.blur_px;
  drawing.shading_per_px = scene.shading_per_px;
  drawing.polygons = {scene.kind == MarkKind::edge     ? edge_of(scene)
                      : scene.kind == MarkKind::corner ? corner_of(scene)
                      : scene.kind == MarkKind::slot   ? slot_of(scene)
                                                       : cross_of(scene)};
  return drawing;
}

MarkSearch search_of(const ShapeScene& scene) {
  MarkSearch search;
  search.kind = scene.kind;
  search.bright = scene.kind != MarkKind::edge && scene.mark > scene.background;
  search.expected_px = search.half_window_px = scene.middle();
  const auto& p = scene.parameters;
  double size = 0;
  if (scene.kind == MarkKind::slot) size = 2 * (1 + p[6]) * std::hypot(p[2], p[3]);
  if (scene.kind == MarkKind::cross) size = std::min(p[5] + p[6], 1.2 * scene.side_px);
  search.min_diameter_px = 0.8 * size;
  search.max_diameter_px = 1.2 * size;
  search.min_axis_ratio = 0.2;
  return search;
}

ShapeScene random_scene(MarkKind kind, std::mt19937_64& random) {
  ShapeScene scene;
  scene.kind = kind;
  const double x = between(-0.5, 0.5, random), y = between(-0.5, 0.5, random),
               angle = between(-pi, pi, random);
  if (kind == MarkKind::edge) scene.parameters = {x, angle};
  if (kind == MarkKind::corner) scene.parameters = {x, y, angle, angle + between(1.3, 1.85, random)};
  if (kind == MarkKind::cross) {
    scene.parameters = {x,  y,  angle, angle + between(1.4, 1.75, random), between(3, 5, random), 24,
                        24, 24, 24};
  }
  if (kind == MarkKind::slot) {
    // A slot of 34 x 14 px tilted by up to 45 degrees about any axis.
    const double tilt = between(-pi, pi, random), squeeze = between(0.71, 1, random);
    const Vector2d t = unit(tilt);
    const auto seen = [&t, squeeze](const Vector2d& e) -> Vector2d {
      return e + (squeeze - 1) * t * t.dot(e);
    };
    const Vector2d along = seen(7 * unit(angle)), across = seen(7 * unit(angle + pi / 2));
    scene.parameters = {x, y, along.x(), along.y(), across.x(), across.y(), 10.0 / 7};
  }
  return scene;
}

Eigen::Matrix2d bound_of(const ShapeScene& scene, double noise_sigma) {
  constexpr double h = 0.01;
  std::vector<std::vector<double>> slopes;
  for (const auto& change : changes_of(scene)) {
    ShapeScene more = scene, less = scene;
    change(more, h);
    change(less, -h);
    std::vector<double> slope = paint(drawing_of(more)).grey;
    const std::vector<double> low = paint(drawing_of(less)).grey;
    for (std::size_t i = 0; i < slope.size(); ++i) slope[i] = (slope[i] - low[i]) / (2 * h);
    slopes.push_back(std::move(slope));
  }
  const auto n = Eigen::Index(slopes.size());
  Eigen::MatrixXd information(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < slopes[0].size(); ++k)
        sum += slopes[std::size_t(i)][k] * slopes[std::size_t(j)][k];
      information(i, j) = sum;
    }
  }
  // The arms' ends do not tell where a cross is unless they are in the picture.
  information.diagonal().array() += 1e-9;
  const Eigen::MatrixXd inverse = information.inverse();
  Eigen::Matrix2d bound = (noise_sigma * noise_sigma + 1.0 / 12) * inverse.topLeftCorner<2, 2>();
  if (scene.kind == MarkKind::edge) bound = Eigen::Matrix2d{{bound(0, 0), 0}, {0, 0}};
  return bound;
}

MarkFinding find_shape(const ImageView& image, const MarkSearch& search) {
  return find_marks(image, {&search, 1}).front();
}

}  // namespace zeropose::test
