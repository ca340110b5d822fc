#include "daemon/cli/measured_references.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "config/text.h"
#include "measure/proposal.h"

namespace zeropose::cli {
namespace {

using Json = nlohmann::json;

Json read_answer(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::invalid_argument(concat({file.string(), ": found no such file"}));
  Json answer = Json::parse(stream, nullptr, false);
  if (!answer.is_object() || !answer.contains("references") || !answer["references"].is_array())
    throw std::invalid_argument(
        concat({file.string(), ": has no references, expected the answer of zeropose measure --json"}));
  return answer;
}

Eigen::Vector2d pixel(const Json& reference, const char* key, const std::string& where) {
  const Json& numbers = reference[key];
  if (!numbers.is_array() || numbers.size() != 2 || !numbers[0].is_number() || !numbers[1].is_number())
    throw std::invalid_argument(concat({where, ": ", key, " is not two numbers"}));
  return {numbers[0].get<double>(), numbers[1].get<double>()};
}

const ReferencePoint& point_named(const Cell& cell, const std::string& name, const std::string& where) {
  const auto& points = cell.references.points;
  const auto point =
      std::ranges::find(points, name, [](const ReferencePoint& each) { return each.mark.name; });
  if (point == points.end())
    throw std::invalid_argument(concat({where, ": the cell has no such reference point"}));
  return *point;
}

}  // namespace

std::vector<RecalibrationPoint> measured_references(const Cell& cell, RecalibrationMethod method,
                                                    bool suited_only, const std::string& camera,
                                                    const std::filesystem::path& file) {
  std::vector<RecalibrationPoint> points;
  bool any = false;
  for (const Json answer = read_answer(file); const Json& reference : answer["references"]) {
    if (!reference.is_object() || reference.value("camera", "") != camera) continue;
    any = true;
    const std::string name = reference.value("point", ""),
                      where = concat({file.string(), ", ", in_quotes(name)});
    if (!reference.contains("before_px"))
      throw std::invalid_argument(concat({where, ": has no before_px: no zero measurement saw it"}));
    if (!reference.contains("after_px")) continue;
    const ReferencePoint& known = point_named(cell, name, where);
    if (suited_only && !counts_for(method, known)) continue;
    if (known.taught_px && method != RecalibrationMethod::arbitrary_points)
      throw std::invalid_argument(
          concat({where, ": the cell file does not have its coordinates; take --method arbitrary"}));
    RecalibrationPoint& point = points.emplace_back();
    point.name = name;
    point.group = known.group;
    point.p_mm = known.mark.p_O_mm;
    point.old_px = pixel(reference, "before_px", where);
    point.new_px = pixel(reference, "after_px", where);
  }
  if (!any)
    throw std::invalid_argument(concat({file.string(), ": has no reference points of ", in_quotes(camera)}));
  return points;
}

}  // namespace zeropose::cli
