// Drawings as SVG text: the few shapes that a report needs. Lengths are millimetres on paper.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>

namespace zeropose {

struct TextStyle {
  double size_mm = 2.8;
  std::string_view colour = "#1c2430";
  std::string_view anchor = "start";  // start, middle, end
  bool bold = false;
  double turn_deg = 0;  // about its own place
};

struct ShapeStyle {
  std::string_view fill = "none";
  std::string_view stroke = "none";
  double width_mm = 0.2;
  double opacity = 1;
};

class Svg {
 public:
  void text(double x, double y, std::string_view words, const TextStyle& style = {});
  void line(double x1, double y1, double x2, double y2, const ShapeStyle& style);
  void rectangle(double x, double y, double width, double height, const ShapeStyle& style);
  void circle(double x, double y, double radius, const ShapeStyle& style);
  void polygon(std::span<const Eigen::Vector2d> points, const ShapeStyle& style);
  void polyline(std::span<const Eigen::Vector2d> points, const ShapeStyle& style);
  // Everything until end_clip() is drawn inside the rectangle only.
  void begin_clip(double x, double y, double width, double height);
  void end_clip();

  // The whole file.
  std::string page(double width_mm, double height_mm) const;

 private:
  void shape(std::string_view element, const std::string& attributes, const ShapeStyle& style);
  void points(std::string_view element, std::span<const Eigen::Vector2d> points, const ShapeStyle& style);

  std::string body_;
  int clips_ = 0;
};

// With so many decimals; never "-0.00".
std::string fixed_text(double value, int decimals);

}  // namespace zeropose
