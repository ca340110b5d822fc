#include "daemon/proposal_json.h"

#include <cmath>

#include "daemon/pose_json.h"

namespace zeropose {
namespace {

using Json = nlohmann::json;

// A translation that is neglected has no sigma.
Json sigma_json(const RecalibrationResult& result) {
  Json sigma = Json::array();
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double value = std::sqrt(result.covariance(i, i)) * (i < 3 ? 1 : degrees_per_radian);
    sigma.push_back(i < 3 && !result.translation_known ? Json() : Json(value));
  }
  return sigma;
}

Json deviations_json(const CameraProposal& proposal) {
  Json deviations = Json::array();
  for (std::size_t i = 0; i < proposal.result.deviations.size(); ++i) {
    const RecalibrationDeviation& deviation = proposal.result.deviations[i];
    deviations.push_back({{"point", proposal.points[i].name},
                          {"dev_px", {deviation.new_px.x(), deviation.new_px.y()}},
                          {"used", deviation.used}});
  }
  return deviations;
}

Json camera_json(const CameraProposal& proposal, const CalibratedCamera& camera) {
  const RecalibrationResult& result = proposal.result;
  const bool good = result.code == Code::ok;
  return {{"camera", camera.name},
          {"method", name_of(proposal.method)},
          {"status", proposal.X_CoCn ? "ok" : "failed"},
          {"reason", proposal.reason},
          {"X_WC_before", six_json(camera.X_WC)},
          {"X_WC", good ? six_json(result.X_WCn) : Json()},
          {"X_CoCn", proposal.X_CoCn ? six_json(*proposal.X_CoCn) : Json()},
          {"sigma", good ? sigma_json(result) : Json()},
          {"rms_px", result.rms_px},
          {"deviations", deviations_json(proposal)},
          {"warnings", result.warnings}};
}

Json effect_json(const Measurement& m) {
  return {{"code", static_cast<int>(m.code)},
          {"name", text_of(m.code).name},
          {"reason", m.reason},
          {"effective_marks", m.pose.effective_marks},
          {"X_O0O", m.code == Code::ok ? six_json(m.X_O0O) : Json()}};
}

}  // namespace

Json proposal_json(const Proposal& proposal, const Cell& cell) {
  if (proposal.cameras.empty()) return nullptr;
  Json cameras = Json::array();
  for (const CameraProposal& camera : proposal.cameras)
    cameras.push_back(camera_json(camera, cell.calibration.at(camera.camera)));
  return {{"cameras", cameras},
          {"effect",
           {{"believed", effect_json(proposal.believed)},
            {"proposed", proposal.proposed ? effect_json(*proposal.proposed) : Json()}}}};
}

}  // namespace zeropose
