#include "daemon/gap_json.h"

#include <algorithm>

#include "daemon/pose_json.h"

namespace zeropose {
namespace {

using Json = nlohmann::json;

Json edge_json(const GapEdge& edge) {
  const MarkFinding& finding = edge.finding;
  return {{"finding", name_of(finding.status)},
          {"u_px", finding.u_px.x()},
          {"v_px", finding.u_px.y()},
          {"quality", finding.quality},
          {"seen_share", finding.outline_share}};
}

Json gap_json(const GapView& gap, const Cell& cell, const GapResult& found) {
  Json json{
      {"gap", gap.name},        {"camera", cell.cameras[gap.camera].name}, {"finding", name_of(found.status)},
      {"reason", found.reason}, {"frame", edge_json(found.frame)},         {"pane", edge_json(found.pane)}};
  if (found.status != GapStatus::ok) return json;
  json["gap_mm"] = found.gap_mm;
  json["sigma_mm"] = found.sigma_mm;
  json["wedge_deg"] = found.wedge_rad * degrees_per_radian;
  return json;
}

// What the evening says of the gaps that were measured.
void add_evening(const GapTask& task, const GapMeasurement& found, Json& gaps) {
  const EveningResult& evening = found.evening;
  for (std::size_t i = 0; i < found.measured.size(); ++i) {
    Json& gap = gaps[found.measured[i]];
    gap["used"] = std::ranges::find(found.used, found.measured[i]) != found.used.end();
    gap["removed"] = std::ranges::find(evening.removed, i) != evening.removed.end();
    gap["deviates_mm"] =
        found.gaps[found.measured[i]].gap_mm - task.gaps[found.measured[i]].wanted_mm - evening.common_mm;
    if (i < evening.predicted_mm.size()) gap["predicted_mm"] = evening.predicted_mm[i];
  }
}

}  // namespace

Json gaps_json(const Job& job, const Cell& cell, const Measurement& measurement) {
  if (!job.gaps || !measurement.gaps) return nullptr;
  const GapMeasurement& found = *measurement.gaps;
  const EveningResult& evening = found.evening;
  Json gaps = Json::array();
  for (std::size_t i = 0; i < found.gaps.size(); ++i)
    gaps.push_back(gap_json(job.gaps->gaps[i], cell, found.gaps[i]));
  add_evening(*job.gaps, found, gaps);
  Json json{{"places", gaps}};
  if (evening.predicted_mm.empty()) return json;
  json["even_already"] = evening.even_already;
  json["uneven_mm"] = evening.worst_mm;
  json["common_mm"] = evening.common_mm;
  json["motion"] = six_json(evening.X_TTn);
  json["predicted_worst_mm"] = evening.predicted_worst_mm;
  json["redundancy"] = evening.redundancy;
  return json;
}

}  // namespace zeropose
