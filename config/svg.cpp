#include "config/svg.h"

#include <array>
#include <cstdio>

#include "config/text.h"

namespace zeropose {
namespace {

std::string escaped(std::string_view words) {
  std::string text;
  for (const char c : words) switch (c) {
      case '&':
        text += "&amp;";
        break;
      case '<':
        text += "&lt;";
        break;
      case '>':
        text += "&gt;";
        break;
      case '"':
        text += "&quot;";
        break;
      default:
        text += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;  // XML knows no control characters
    }
  return text;
}

std::string attribute(std::string_view name, double value) {
  return concat({" ", name, "=\"", fixed_text(value, 3), "\""});
}
std::string attribute(std::string_view name, std::string_view value) {
  return concat({" ", name, "=\"", value, "\""});
}

}  // namespace

std::string fixed_text(double value, int decimals) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  const std::string_view written = text.data();
  const bool zero = written.find_first_not_of("-0.") == std::string_view::npos;
  return std::string(zero && written.starts_with('-') ? written.substr(1) : written);
}

void Svg::text(double x, double y, std::string_view words, const TextStyle& style) {
  body_ += concat({"<text", attribute("x", x), attribute("y", y), attribute("font-size", style.size_mm),
                   attribute("fill", style.colour), attribute("text-anchor", style.anchor)});
  if (style.bold) body_ += attribute("font-weight", "bold");
  if (style.turn_deg != 0)
    body_ += attribute("transform", concat({"rotate(", fixed_text(style.turn_deg, 1), " ", fixed_text(x, 3),
                                            " ", fixed_text(y, 3), ")"}));
  body_ += concat({">", escaped(words), "</text>\n"});
}

void Svg::shape(std::string_view element, const std::string& attributes, const ShapeStyle& style) {
  body_ += concat({"<", element, attributes, attribute("fill", style.fill), attribute("stroke", style.stroke),
                   attribute("stroke-width", style.width_mm)});
  if (style.opacity < 1) body_ += attribute("opacity", style.opacity);
  body_ += "/>\n";
}

void Svg::line(double x1, double y1, double x2, double y2, const ShapeStyle& style) {
  shape("line", attribute("x1", x1) + attribute("y1", y1) + attribute("x2", x2) + attribute("y2", y2), style);
}

void Svg::rectangle(double x, double y, double width, double height, const ShapeStyle& style) {
  shape("rect",
        attribute("x", x) + attribute("y", y) + attribute("width", width) + attribute("height", height),
        style);
}

void Svg::circle(double x, double y, double radius, const ShapeStyle& style) {
  shape("circle", attribute("cx", x) + attribute("cy", y) + attribute("r", radius), style);
}

void Svg::points(std::string_view element, std::span<const Eigen::Vector2d> points, const ShapeStyle& style) {
  std::string list;
  for (const Eigen::Vector2d& point : points)
    list += concat({list.empty() ? "" : " ", fixed_text(point.x(), 3), ",", fixed_text(point.y(), 3)});
  shape(element, attribute("points", list), style);
}

void Svg::polygon(std::span<const Eigen::Vector2d> corners, const ShapeStyle& style) {
  points("polygon", corners, style);
}

void Svg::polyline(std::span<const Eigen::Vector2d> corners, const ShapeStyle& style) {
  points("polyline", corners, style);
}

void Svg::begin_clip(double x, double y, double width, double height) {
  const std::string id = concat({"clip", std::to_string(++clips_)});
  body_ += concat({"<clipPath id=\"", id, "\"><rect", attribute("x", x), attribute("y", y),
                   attribute("width", width), attribute("height", height),
                   "/></clipPath>\n<g clip-path=\"url(#", id, ")\">\n"});
}

void Svg::end_clip() { body_ += "</g>\n"; }

std::string Svg::page(double width_mm, double height_mm) const {
  const std::string width = fixed_text(width_mm, 0), height = fixed_text(height_mm, 0);
  return concat({"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n",
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", width, "mm\" height=\"", height,
                 "mm\" viewBox=\"0 0 ", width, " ", height,
                 "\" font-family=\"DejaVu Sans, Verdana, Arial, sans-serif\">\n",
                 "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n", body_, "</svg>\n"});
}

}  // namespace zeropose
