#include "tests/support/mark_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace zeropose::test {
namespace {

constexpr double pi = 3.14159265358979323846;

// The point spread along one axis (Gauss convolved with the pixel's box) and its running integral, both by
// summation on a grid of 1/256 px.
class Spread {
 public:
  explicit Spread(double sigma) : reach_(4.5 * sigma + 0.5) {
    const int n = 2 * static_cast<int>(std::ceil(reach_ * steps_)) + 1;
    density_.resize(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
      const double x = (i - n / 2) / double{steps_};
      double sum = 0;  // midpoint rule over the box
      for (int k = 0; k < 64; ++k) {
        const double y = (x - 0.5 + (k + 0.5) / 64) / sigma;
        sum += std::exp(-0.5 * y * y);
      }
      density_[static_cast<std::size_t>(i)] = sum;
    }
    integral_.resize(density_.size());
    double total = 0;
    for (std::size_t i = 1; i < density_.size(); ++i) {
      total += 0.5 * (density_[i - 1] + density_[i]);
      integral_[i] = total;
    }
    for (double& value : integral_) value /= total;
    for (double& value : density_) value *= steps_ / total;
  }

  double reach() const { return reach_; }
  double density(double x) const { return at(density_, x, 0, 0); }
  double integral(double x) const { return at(integral_, x, 0, 1); }

 private:
  static double at(const std::vector<double>& table, double x, double below, double above) {
    const double place = x * steps_ + double(table.size() / 2);
    if (place <= 0) return below;
    if (place >= double(table.size() - 1)) return above;
    const auto i = static_cast<std::size_t>(place);
    const double part = place - double(i);
    return table[i] * (1 - part) + table[i + 1] * part;
  }

  static constexpr int steps_ = 256;
  double reach_;
  std::vector<double> density_, integral_;
};

struct Span {
  double from = 0, to = -1;
};

Span span_of_ellipse(const Figure& f, double y) {
  const double c = std::cos(f.angle_rad), s = std::sin(f.angle_rad);
  const double ia = 1 / (f.a_px * f.a_px), ib = 1 / (f.b_px * f.b_px);
  const double A = c * c * ia + s * s * ib, B = c * s * (ia - ib), C = s * s * ia + c * c * ib;
  const double v = y - f.centre_px.y(), root = B * B * v * v - A * (C * v * v - 1);
  if (root <= 0) return {};
  return {f.centre_px.x() + (-B * v - std::sqrt(root)) / A, f.centre_px.x() + (-B * v + std::sqrt(root)) / A};
}

Span span_of_polygon(const Figure& f, double y) {
  Span span{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (std::size_t k = 0; k < f.corners_px.size(); ++k) {
    const Eigen::Vector2d &p = f.corners_px[k], &q = f.corners_px[(k + 1) % f.corners_px.size()];
    if ((p.y() <= y) == (q.y() <= y)) continue;
    const double x = p.x() + (y - p.y()) / (q.y() - p.y()) * (q.x() - p.x());
    span.from = std::min(span.from, x);
    span.to = std::max(span.to, x);
  }
  return span;
}

// A line across the figure that stands for a strip of the given height.
struct Strip {
  double y, height;
};

// Polygons: equal strips. Ellipses: strips that close up towards the poles (y = cos t, equal steps of t),
// where the width falls to zero like a root: equal ones would be wrong by thousandths of a pixel there.
std::vector<Strip> strips_of(const Figure& figure, const Drawing& drawing, int reach) {
  std::vector<Strip> strips;
  if (figure.corners_px.empty()) {
    const double half =
        std::hypot(figure.a_px * std::sin(figure.angle_rad), figure.b_px * std::cos(figure.angle_rad));
    const int n = static_cast<int>(std::ceil(2 * half * drawing.fineness)) + 16;
    for (int k = 0; k < n; ++k) {
      const double t = pi * (k + 0.5) / n;
      strips.push_back({figure.centre_px.y() + half * std::cos(t), half * std::sin(t) * pi / n});
    }
    return strips;
  }
  for (int j = -reach * drawing.fineness; j < (drawing.height_px + reach) * drawing.fineness; ++j) {
    strips.push_back({(j + 0.5) / drawing.fineness - 0.5, 1.0 / drawing.fineness});
  }
  return strips;
}

// Paints the figure over what is there, weighted by its blurred coverage.
void paint_over(Picture& picture, const Figure& figure, const Spread& spread, const Drawing& drawing) {
  const int reach = static_cast<int>(std::ceil(spread.reach())), w = picture.width_px;
  std::vector<double> cover(picture.grey.size(), 0.0), line(static_cast<std::size_t>(w));
  for (const auto& [y, height] : strips_of(figure, drawing, reach)) {
    const Span span = figure.corners_px.empty() ? span_of_ellipse(figure, y) : span_of_polygon(figure, y);
    if (!(span.to > span.from)) continue;
    for (int u = 0; u < w; ++u) {
      line[static_cast<std::size_t>(u)] = spread.integral(u - span.from) - spread.integral(u - span.to);
    }
    const int first = std::max(0, static_cast<int>(std::ceil(y - spread.reach())));
    const int last = std::min(picture.height_px - 1, static_cast<int>(std::floor(y + spread.reach())));
    for (int v = first; v <= last; ++v) {
      const double weight = spread.density(v - y) * height;
      double* row = cover.data() + std::ptrdiff_t{v} * w;
      for (int u = 0; u < w; ++u) row[u] += weight * line[static_cast<std::size_t>(u)];
    }
  }
  for (std::size_t i = 0; i < cover.size(); ++i) {
    picture.grey[i] += cover[i] * (figure.grey - picture.grey[i]);
  }
}

double between(double low, double high, std::mt19937_64& random) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

// A regular polygon stretched along one direction.
Figure polygon(int corners, const Eigen::Vector2d& centre, double a, double b, double angle, double grey) {
  Figure figure;
  figure.grey = grey;
  const double c = std::cos(angle), s = std::sin(angle);
  for (int k = 0; k < corners; ++k) {
    const double t = 2 * pi * (k + 0.5) / corners;
    const Eigen::Vector2d q(a * std::cos(t), b * std::sin(t));
    figure.corners_px.push_back(centre + Eigen::Vector2d(c * q.x() - s * q.y(), s * q.x() + c * q.y()));
  }
  return figure;
}

}  // namespace

Figure ellipse(const Eigen::Vector2d& centre_px, double diameter_px, double axis_ratio, double angle_rad,
               double grey) {
  return {centre_px, diameter_px / 2, diameter_px / 2 * axis_ratio, angle_rad, {}, grey};
}

void add_clutter(Drawing& drawing, double min_diameter_px, double max_diameter_px, double keep_clear_px,
                 std::mt19937_64& random) {
  const double w = drawing.width_px, h = drawing.height_px, far = std::hypot(w, h);
  const Eigen::Vector2d middle(0.5 * (w - 1), 0.5 * (h - 1));
  const int count = std::uniform_int_distribution<int>(3, 9)(random);
  for (int k = 0; k < count;) {
    const Eigen::Vector2d at(between(0, w, random), between(0, h, random));
    const double angle = between(0, 3.1416, random), grey = between(30, 220, random);
    const double size = between(min_diameter_px, max_diameter_px, random);
    double reach = size;
    Figure figure;
    switch (std::uniform_int_distribution<int>(0, 5)(random)) {
      case 0:
        reach = between(5, 20, random), figure = polygon(4, at, far, reach, angle, grey);
        break;
      case 1:
        figure = polygon(6, at, size / 2, size / 2, angle, grey);
        break;
      case 2:
        figure = polygon(4, at, size, size * between(0.6, 1, random), angle, grey);
        break;
      case 3:
        reach = min_diameter_px, figure = ellipse(at, 0.7 * reach, 1, 0, grey);
        break;
      case 4:
        reach = 1.4 * max_diameter_px, figure = ellipse(at, reach, 1, 0, grey);
        break;
      default:
        figure = polygon(3, at, size, size / 2, angle, grey);
        break;
    }
    const bool beam = !figure.corners_px.empty() && reach != size;
    const double off = beam ? std::abs(Eigen::Vector2d(-std::sin(angle), std::cos(angle)).dot(at - middle))
                            : (at - middle).norm();
    if (keep_clear_px > 0 && off < keep_clear_px + reach) {
      if (between(0, 1, random) < 0.2) ++k;  // no room is no reason to try for ever
      continue;
    }
    drawing.figures.push_back(figure);
    ++k;
  }
}

Picture paint(const Drawing& drawing) {
  Picture picture{drawing.width_px, drawing.height_px, {}};
  picture.grey.assign(
      static_cast<std::size_t>(drawing.width_px) * static_cast<std::size_t>(drawing.height_px),
      drawing.background);
  const Spread spread(drawing.blur_sigma_px);
  for (const Figure& figure : drawing.figures) paint_over(picture, figure, spread, drawing);
  for (int v = 0; v < drawing.height_px; ++v) {
    for (int u = 0; u < drawing.width_px; ++u) {
      const Eigen::Vector2d off(u - 0.5 * (drawing.width_px - 1), v - 0.5 * (drawing.height_px - 1));
      picture.grey[static_cast<std::size_t>(v * drawing.width_px + u)] *= 1 + drawing.shading_per_px.dot(off);
    }
  }
  return picture;
}

Pixels expose(const Picture& picture, double noise_sigma, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Pixels pixels{picture.width_px, picture.height_px, picture.width_px, {}};
  pixels.grey.reserve(picture.grey.size());
  for (const double grey : picture.grey) {
    const double value = noise_sigma > 0 ? grey + noise_sigma * normal(random) : grey;
    pixels.grey.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))));
  }
  return pixels;
}

}  // namespace zeropose::test
