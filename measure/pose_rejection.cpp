#include "measure/pose_rejection.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "calib/words.h"

namespace zeropose {
namespace {

using Set = std::vector<std::size_t>;

// Chance that good observations alone raise the alarm, per estimate.
constexpr double false_alarm = 0.001;
// More sets of equal size than this are not tried one by one.
constexpr double max_sets = 2000;

// r / sigma of r, as the length of a vector: r' Cov(r)^-1 r, all whitened, with
// Cov(r) = C - H C - C H' + J Cov(pose) J', H = J N^-1 J'; for an unused observation C + J Cov(pose) J'.
// Also r' C^-1 r.
struct Normalised {
  double deviation = std::numeric_limits<double>::infinity(), misfit = 0;
};

Normalised normalise(const PoseModel& model, const Precision& precision, const Sight& sight) {
  if (!sight.visible) return {};
  const Eigen::Matrix2d C = sight.whitening * model.total_covariance(sight) * sight.whitening.transpose();
  // Where an observation is not controlled by the others both r and its variance vanish: keep a little.
  Eigen::Matrix2d Q = (1 + 1e-9) * C + sight.WJ.transpose() * (precision.total_covariance * sight.WJ);
  if (sight.active) {
    const Eigen::Matrix2d HC = sight.WJ.transpose() * (precision.inverse_N * sight.WJ) * C;
    Q -= HC + HC.transpose();
  }
  const double square = sight.Wr.dot(Q.inverse() * sight.Wr);
  return {std::sqrt(std::max(0.0, square)), sight.Wr.dot(C.inverse() * sight.Wr)};
}

Set active_of(const PoseModel& model) {
  Set active;
  for (std::size_t i = 0; i < model.sights().size(); ++i)
    if (model.sights()[i].active) active.push_back(i);
  return active;
}

// Of the length of a normalised deviation, two degrees of freedom.
double critical_value(std::size_t observations) {
  return std::sqrt(-2 * std::log(false_alarm / static_cast<double>(observations)));
}

bool is_wrong(const Sight& sight, double normalised, double critical) {
  const Eigen::Vector2d dev_mm(sight.dev_px.x() / sight.camera->fx_px * sight.depth_mm,
                               sight.dev_px.y() / sight.camera->fy_px * sight.depth_mm);
  return !(sight.dev_px.norm() <= sight.mark->tolerance_px) || !(dev_mm.norm() <= sight.mark->tolerance_mm) ||
         !(normalised <= critical);
}

// The active observation that deviates most among the wrong ones.
std::optional<std::size_t> worst(const PoseModel& model, const Estimate& estimate) {
  const Set active = active_of(model);
  const double critical = critical_value(active.size());
  std::optional<std::size_t> found;
  for (const std::size_t i : active)
    if (is_wrong(model.sights()[i], estimate.normalised[i], critical) &&
        (!found || estimate.normalised[i] > estimate.normalised[*found]))
      found = i;
  return found;
}

void set_active(PoseModel& model, const Set& set, bool active) {
  for (const std::size_t i : set) model.sights()[i].active = active;
}

double combinations(std::size_t n, std::size_t k) {
  double count = 1;
  for (std::size_t i = 0; i < k; ++i) count *= static_cast<double>(n - i) / static_cast<double>(i + 1);
  return count;
}

// All sets of k of the given observations.
std::vector<Set> all_sets(const Set& from, std::size_t k) {
  std::vector<Set> sets;
  std::vector<bool> chosen(from.size(), false);
  std::fill_n(chosen.begin(), k, true);
  do {
    Set& set = sets.emplace_back();
    for (std::size_t i = 0; i < from.size(); ++i)
      if (chosen[i]) set.push_back(from[i]);
  } while (std::prev_permutation(chosen.begin(), chosen.end()));
  return sets;
}

struct Explanation {
  Set removed;
  Estimate estimate;
};

class Search {
 public:
  Search(PoseModel& model, const Estimate& all) : model_(model), all_(all), active_(active_of(model)) {}

  // Sets without which all others agree, best first.
  std::vector<Explanation> explanations(std::size_t k) {
    std::vector<Explanation> found;
    for (Set& set : candidates(k)) {
      set_active(model_, set, false);
      Estimate rest = estimate(model_, all_.solution.pose);
      if (rest.ok() && !worst(model_, rest)) found.push_back({set, std::move(rest)});
      set_active(model_, set, true);
    }
    std::stable_sort(found.begin(), found.end(), [](const Explanation& a, const Explanation& b) {
      return a.estimate.misfit < b.estimate.misfit;
    });
    return found;
  }

  // As many as may be removed: the rest must still check itself and be the majority.
  std::size_t largest_set() const {
    std::size_t k = 0;
    while (may_remove(k + 1)) ++k;
    return k;
  }

 private:
  bool may_remove(std::size_t k) const {
    if (2 * k >= active_.size()) return false;
    const int left = static_cast<int>(active_.size() - k);
    return 2 * left > model_.unknowns() && left >= (model_.planar() ? 2 : 3);
  }

  std::vector<Set> candidates(std::size_t k) {
    if (combinations(active_.size(), k) <= max_sets) return all_sets(active_, k);
    return greedy_sets(k);
  }

  // Too many to try all: the worst one by one, and that set with each of its members exchanged.
  std::vector<Set> greedy_sets(std::size_t k) {
    Set greedy;
    Estimate rest = all_;
    while (greedy.size() < k) {
      const auto next = worst(model_, rest);
      if (!next) break;
      greedy.push_back(*next);
      model_.sights()[*next].active = false;
      rest = estimate(model_, rest.solution.pose);
    }
    set_active(model_, greedy, true);
    if (greedy.size() < k) return {};
    std::vector<Set> sets{greedy};
    for (std::size_t place = 0; place < k; ++place)
      for (const std::size_t other : active_) {
        if (std::find(greedy.begin(), greedy.end(), other) != greedy.end()) continue;
        sets.push_back(greedy);
        sets.back()[place] = other;
      }
    return sets;
  }

  PoseModel& model_;
  const Estimate& all_;
  Set active_;
};

std::string accusation(const PoseModel& model, std::size_t i) {
  const Sight& sight = model.sights()[i];
  return "mark " + sight.mark->name + " deviates by " + number(sight.dev_px.norm()) + " px";
}

Rejection refused(Estimate estimate, std::string reason) {
  return {Code::deviation_not_attributable, std::move(reason), std::move(estimate), {}};
}

Rejection accepted(PoseModel& model, const Explanation& explanation) {
  set_active(model, explanation.removed, false);
  Rejection rejection{Code::ok, {}, estimate(model, explanation.estimate.solution.pose), explanation.removed};
  std::stable_sort(rejection.removed.begin(), rejection.removed.end(), [&rejection](auto a, auto b) {
    return rejection.estimate.normalised[a] > rejection.estimate.normalised[b];
  });
  return rejection;
}

}  // namespace

Estimate estimate(PoseModel& model, const CentredPose& start) {
  Estimate estimate;
  estimate.solution = refine(model, start);
  if (estimate.solution.status != SolverStatus::converged) return estimate;
  estimate.precision = precision_of(model, estimate.solution);
  estimate.normalised.reserve(model.sights().size());
  for (const Sight& sight : model.sights()) {
    const Normalised normalised = normalise(model, estimate.precision, sight);
    estimate.normalised.push_back(normalised.deviation);
    if (sight.active) estimate.misfit += normalised.misfit;
  }
  return estimate;
}

Rejection reject_wrong_marks(PoseModel& model, const Estimate& all) {
  const auto suspect = worst(model, all);
  if (!suspect) return {Code::ok, {}, all, {}};
  const std::string accused = accusation(model, *suspect);
  Search search(model, all);
  const std::size_t largest = search.largest_set();
  for (std::size_t k = 1; k <= largest; ++k) {
    const auto explanations = search.explanations(k);
    if (explanations.empty()) continue;
    if (explanations.size() > 1 &&
        explanations[1].estimate.misfit - explanations[0].estimate.misfit < equal_misfit)
      return refused(all, accused + ", but " + number(explanations.size()) + " different choices of " +
                              number(k) + " wrong marks explain it and the best two equally well");
    return accepted(model, explanations.front());
  }
  return refused(all, accused + ", and with " + number(model.active_count()) +
                          " observations no removal of up to " + number(largest) +
                          " of them makes the others agree");
}

}  // namespace zeropose
