#include "sim/tyre.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace zeropose {
namespace {

constexpr double steps_per_mm = 20;  // of the section's table
constexpr double letter_side_mm = 0.35;

// Of the section, exact.
TyreSurface::Height section_of(const TyreShape& shape, double radius_mm) {
  const double half_mm = (shape.tread_mm - shape.bead_mm) / 2;
  const double off = (radius_mm - shape.widest_mm) / half_mm;
  TyreSurface::Height height{-shape.drop_mm * off * off, -2 * shape.drop_mm * off / half_mm};
  for (const TyreRing& ring : shape.rings) {
    const double x = (radius_mm - ring.radius_mm) / ring.sigma_mm;
    const double bell = ring.height_mm * std::exp(-x * x / 2);
    height.z_mm += bell;
    height.slope -= bell * x / ring.sigma_mm;
  }
  return height;
}

// A number that looks drawn, of whole numbers.
std::uint32_t mixed(std::uint32_t a, std::uint32_t b) {
  std::uint32_t h = a * 0x9E3779B1U ^ (b + 0x85EBCA6BU) * 0xC2B2AE35U;
  h ^= h >> 15;
  h *= 0x2C1B3C6DU;
  return h ^ h >> 13;
}

// 1 where `inside_mm` > 0, 0 where it is < -side, a straight side between.
double soft(double inside_mm) { return std::clamp(1 + inside_mm / letter_side_mm, 0.0, 1.0); }

// A letter of strokes in a box of width x height with the place (x, y) in it.
double letter(std::uint32_t word, double x, double y, double width, double height) {
  constexpr double stroke = 1.6;
  const auto bar = [&](double at, double place, double half) { return soft(half - std::abs(place - at)); };
  double ink = 0;
  const double box = std::min(soft(std::min(x, width - x) - 0.8), soft(std::min(y, height - y)));
  if (word & 1U) ink = std::max(ink, bar(0.8 + stroke / 2, x, stroke / 2));
  if (word & 2U) ink = std::max(ink, bar(width - 0.8 - stroke / 2, x, stroke / 2));
  if (word & 4U) ink = std::max(ink, bar(stroke / 2, y, stroke / 2));
  if (word & 8U) ink = std::max(ink, bar(height / 2, y, stroke / 2));
  if (word & 16U) ink = std::max(ink, bar(height - stroke / 2, y, stroke / 2));
  return std::min(ink, box);
}

}  // namespace

std::vector<TyreShape> example_tyres() {
  const double turn = 6.283185307179586;
  TyreShape small{"175/65 R14", 192, 284, 240, 16, {}, {}, {}, {}};
  small.rings = {{209, 2.4, 1.9}, {222, -1.0, 1.5}, {262, 1.9, 1.7}, {271, -1.0, 1.5}};
  small.lettering = {{232, 245, 0.0, turn, 9, 0.6, 5}};
  TyreShape medium{"205/55 R16", 216, 314, 266, 18, {}, {}, {}, {}};
  medium.rings = {{234, 2.4, 1.9}, {246, -0.8, 1.6}, {285, 1.5, 1.7}, {294, -0.9, 1.5}};
  medium.lettering = {{255, 270, 0.2, 2.9, 10, 0.7, 3}, {257, 268, 3.3, 6.0, 8, 0.5, 9}};
  TyreShape large{"245/40 R19", 250, 336, 295, 14, {}, {}, {}, {}};
  large.rings = {{262, 3.0, 2.6}, {312, 1.2, 1.5}, {320, -0.9, 1.4}};
  large.lettering = {{280, 294, 0.5, 5.8, 11, 0.6, 7}};
  return {small, medium, large};
}

TyreSurface::TyreSurface(const TyreShape& shape) : shape_(shape) {
  const auto count = static_cast<std::size_t>((shape.tread_mm - shape.bead_mm) * steps_per_mm) + 2;
  for (std::size_t i = 0; i < count; ++i) {
    const Height height = section_of(shape, shape.bead_mm + static_cast<double>(i) / steps_per_mm);
    z_mm_.push_back(static_cast<float>(height.z_mm));
    slope_.push_back(static_cast<float>(height.slope));
  }
}

TyreSurface::Height TyreSurface::section(double radius_mm) const {
  const double x = (std::clamp(radius_mm, shape_.bead_mm, shape_.tread_mm) - shape_.bead_mm) * steps_per_mm;
  const std::size_t i = std::min(static_cast<std::size_t>(x), z_mm_.size() - 2);
  const double part = x - static_cast<double>(i);
  const auto between = [&](const std::vector<float>& table) {
    return (1 - part) * table[i] + part * table[i + 1];
  };
  return {between(z_mm_), between(slope_)};
}

double TyreSurface::letter_at(double radius_mm, double angle_rad) const {
  double most = 0;
  for (const TyreLettering& lettering : shape_.lettering) {
    if (radius_mm < lettering.inner_mm || radius_mm > lettering.outer_mm) continue;
    const double angle = angle_rad < 0 ? angle_rad + 6.283185307179586 : angle_rad;
    if (angle < lettering.from_rad || angle > lettering.to_rad) continue;
    const double along = (angle - lettering.from_rad) * (lettering.inner_mm + lettering.outer_mm) / 2;
    const double cell = std::floor(along / lettering.letter_mm);
    const std::uint32_t word = mixed(lettering.word, static_cast<std::uint32_t>(cell));
    if (word % 3 == 0) continue;
    most = std::max(most, lettering.height_mm * letter(word >> 8, along - cell * lettering.letter_mm,
                                                       radius_mm - lettering.inner_mm, lettering.letter_mm,
                                                       lettering.outer_mm - lettering.inner_mm));
  }
  return most;
}

TyreSurface::Height TyreSurface::at(const Eigen::Vector2d& place_mm) const {
  const double radius_mm = place_mm.norm();
  Height height = section(radius_mm);
  for (const TyreLump& lump : shape_.lumps) {
    const double off = (place_mm - lump.centre_mm).norm() / lump.sigma_mm;
    height.z_mm += lump.height_mm * std::exp(-off * off / 2);
  }
  const bool letters = std::ranges::any_of(shape_.lettering, [&](const TyreLettering& lettering) {
    return radius_mm >= lettering.inner_mm && radius_mm <= lettering.outer_mm;
  });
  if (!letters && shape_.waves.empty()) return height;
  const double angle_rad = std::atan2(place_mm.y(), place_mm.x());
  if (letters) {
    const double up_mm = letter_at(radius_mm, angle_rad);
    height.z_mm += up_mm;
    height.letter = up_mm > 0;
  }
  for (const TyreWave& wave : shape_.waves)
    height.z_mm += wave.amplitude_mm * std::cos(wave.waves * angle_rad + wave.phase_rad);
  return height;
}

}  // namespace zeropose
