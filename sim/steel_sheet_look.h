// A steel sheet on a conveyor.
#pragma once

#include <optional>

#include "sim/look.h"

namespace zeropose {

class SteelSheetLook final : public Look {
 public:
  // Throws std::invalid_argument for marks that are neither round holes nor corners of the outline.
  SteelSheetLook(const SheetObject& sheet, const Scene& scene, std::size_t camera);
  void paint(Canvas& canvas, const Moment& moment) const override;
  Illumination light() const override { return light_; }

 private:
  struct Feature {
    std::string name;
    Eigen::Vector2d place_mm = Eigen::Vector2d::Zero();
    double radius_mm = 0;               // of a hole
    std::optional<std::size_t> corner;  // index into the outline
    std::vector<Thing> cover;           // about its place
  };
  Feature feature_of(const Mark& mark) const;
  // Where a feature is now, in O.
  Eigen::Vector2d place_of(const Feature& feature, const CameraModel& camera, const Moment& moment) const;
  PolygonOutline outline(const CameraModel& camera, const Moment& moment) const;

  double surface_grey_, gap_grey_;
  Illumination light_;
  std::vector<Eigen::Vector2d> outline_mm_;
  std::vector<Feature> features_;
  Sheet conveyor_;  // in W
  Sheet surface_;   // of the steel, in O, reaching beyond its outline
};

}  // namespace zeropose
