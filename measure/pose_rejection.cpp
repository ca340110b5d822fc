#include "measure/pose_rejection.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/words.h"
#include "measure/pose_deletion.h"
#include "measure/reliability.h"
#include "measure/small_cholesky.h"

namespace zeropose {
namespace {

using Set = std::vector<std::size_t>;

// Explanations whose poses differ by no more than four standard deviations need not be told apart.
constexpr double same_pose2 = 16;
// More sets of equal size than this are not looked at one by one, and of these not more than that many are
// estimated.
constexpr double max_sets = 5000;
constexpr std::size_t max_estimates = 64;

bool is_wrong(const PoseModel& model, std::size_t i, double critical) {
  const Mark& mark = model.mark(i);
  return !(model.normalised(i) <= critical) || !(model.dev_px(i).norm() <= mark.tolerance_px) ||
         !(model.dev_mm(i).norm() <= mark.tolerance_mm);
}

// The active observation that deviates most among the wrong ones.
std::optional<std::size_t> worst(const PoseModel& model) {
  const double critical = critical_deviation(static_cast<std::size_t>(model.active_count()));
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < model.size(); ++i)
    if (model.active(i) && is_wrong(model, i, critical) &&
        (!found || model.normalised(i) > model.normalised(*found)))
      found = i;
  return found;
}

void set_active(PoseModel& model, const Set& set, bool active) {
  for (const std::size_t i : set) model.set_active(i, active);
}

double combinations(std::size_t n, std::size_t k) {
  double count = 1;
  for (std::size_t i = 0; i < k; ++i) count *= static_cast<double>(n - i) / static_cast<double>(i + 1);
  return count;
}

struct Explanation {
  Set removed;
  Estimate estimate;
};

// Square of the difference of two poses by the covariance of the first.
double distance2(const PoseModel& model, const Estimate& estimate, const CentredPose& other) {
  const CentredPose& pose = estimate.solution.pose;
  Vector6 apart;
  apart << other.p_WM_mm - pose.p_WM_mm, model.extent_mm() * log_so3(other.R_WO * pose.R_WO.transpose());
  const Matrix6& C = estimate.precision.total_covariance;
  if (model.planar()) {
    const auto& basis = model.planar_basis();
    const SmallCholesky<3> cholesky(basis.transpose() * C * basis);
    return cholesky.ok() ? cholesky.forward(basis.transpose() * apart).squaredNorm() : no_tolerance;
  }
  const SmallCholesky<6> cholesky(C);
  return cholesky.ok() ? cholesky.forward(apart).squaredNorm() : no_tolerance;
}

// What the sets of one size explain.
struct Explanations {
  std::vector<Explanation> all;
  std::size_t best = 0;
  std::vector<Explanation> rivals;  // larger sets that are one fault as well: all marks of one camera
  bool complete = true;             // all sets that could have been as good were looked at
  bool model_is_there = false;      // the model is linearised at the best

  double misfit() const { return all[best].estimate.misfit; }
  void add(Explanation explanation) {
    model_is_there = all.empty() || explanation.estimate.misfit < misfit();
    if (model_is_there) best = all.size();
    all.push_back(std::move(explanation));
  }
  // Is the best one better than all others, or are they the same pose?
  bool is_clear(const PoseModel& model) const {
    const auto same_pose = [&](const Explanation& other) {
      return distance2(model, all[best].estimate, other.estimate.solution.pose) <= same_pose2;
    };
    return complete && std::all_of(rivals.begin(), rivals.end(), same_pose) &&
           std::all_of(all.begin(), all.end(), [&](const Explanation& other) {
             return &other == &all[best] || other.estimate.misfit - misfit() >= equal_misfit ||
                    same_pose(other);
           });
  }
};

class Search {
 public:
  Search(PoseModel& model, const Estimate& all) : model_(model), all_(all) {
    for (std::size_t i = 0; i < model.size(); ++i)
      if (model.active(i)) active_.push_back(i);
    if (active_.size() <= max_deletion_size) fit_.emplace(model);
  }

  std::size_t active_count() const { return active_.size(); }

  // As many as may be removed: the rest must still check itself and be the majority.
  std::size_t largest_set() const {
    std::size_t k = 0;
    while (may_remove(k + 1)) ++k;
    return k;
  }

  bool can_try_all(std::size_t k) const { return fit_ && combinations(active_.size(), k) <= max_sets; }

  // The sets of k without which all others agree. Only those are estimated whose linear misfit, as far as it
  // can be trusted, lets them.
  Explanations explanations(std::size_t k) {
    Explanations found;
    const double limit = std::sqrt(agreeing_misfit(k)) + fit_->doubt();
    std::size_t estimates = 0;
    for (const Deletion& deletion : fit_->sets(k, limit * limit)) {
      if (!found.all.empty()) {
        const double as_good = std::sqrt(found.misfit() + equal_misfit) + fit_->doubt();
        if (deletion.misfit > as_good * as_good) break;
      }
      if (++estimates > max_estimates) {
        found.complete = false;
        break;
      }
      try_without(deletion.set, moved(all_.solution.pose, fit_->step_without(deletion.set)), found);
    }
    if (!found.all.empty()) add_rivals(found);
    return found;
  }

  // The marks of a camera that was moved err together: one fault, however many they are. Without them the
  // others must not agree on another pose.
  void add_rivals(Explanations& found) {
    const Set removed = found.all[found.best].removed;
    Explanations cameras;
    std::vector<bool> seen;
    for (const std::size_t first : active_) {
      const std::size_t camera = model_.observation(first).camera;
      if (seen.size() <= camera) seen.resize(camera + 1);
      if (seen[camera]) continue;
      seen[camera] = true;
      Set set;
      for (const std::size_t i : active_)
        if (model_.observation(i).camera == camera) set.push_back(i);
      const int left = static_cast<int>(active_.size() - set.size());
      if (set.size() <= removed.size() || 2 * left <= model_.unknowns() ||
          std::includes(set.begin(), set.end(), removed.begin(), removed.end()))
        continue;
      const double limit = std::sqrt(agreeing_misfit(set.size())) + fit_->doubt();
      if (!(fit_->misfit_without(set) <= limit * limit)) continue;
      found.model_is_there = false;
      try_without(set, moved(all_.solution.pose, fit_->step_without(set)), cameras);
    }
    found.rivals = std::move(cameras.all);
  }

  // Too many to try all: the worst one by one, then back with those that agree after all, and that set with
  // each of its members exchanged for another.
  Explanations greedy(std::size_t largest) {
    Explanations found;
    std::optional<Explanation> start = one_by_one(largest);
    if (!start) return found;
    const Set removed = start->removed;
    const CentredPose from = start->estimate.solution.pose;
    found.add(std::move(*start));
    found.model_is_there = false;
    std::size_t estimates = 0;
    set_active(model_, removed, false);
    const Estimate rest = estimate(model_, from);
    const std::vector<Deletion> others = exchanges(model_, removed, rest.misfit + equal_misfit);
    set_active(model_, removed, true);
    for (const Deletion& other : others) {
      found.complete = ++estimates <= max_estimates;
      if (!found.complete) break;
      try_without(other.set, from, found);
    }
    return found;
  }

 private:
  bool may_remove(std::size_t k) const {
    if (2 * k >= active_.size()) return false;
    const int left = static_cast<int>(active_.size() - k);
    return 2 * left > model_.unknowns() && left >= (model_.planar() ? 2 : 3);
  }

  // Agreeing observations leave no larger misfit: each has its critical value, and its deviation has no more
  // than its own variance, with weights that are not inverse variances not much more.
  double agreeing_misfit(std::size_t k) const {
    const double critical = critical_deviation(active_.size());
    return static_cast<double>(active_.size() - k) * critical * critical * (model_.plain() ? 1 : 2);
  }

  void try_without(const Set& set, const CentredPose& start, Explanations& found) {
    set_active(model_, set, false);
    Estimate rest = estimate(model_, start);
    found.model_is_there = false;
    if (rest.ok() && !worst(model_)) found.add({set, std::move(rest)});
    set_active(model_, set, true);
  }

  std::optional<Explanation> one_by_one(std::size_t largest) {
    Explanation greedy{{}, all_};
    while (const auto next = greedy.estimate.ok() ? worst(model_) : std::nullopt) {
      if (greedy.removed.size() == largest) break;
      greedy.removed.push_back(*next);
      model_.set_active(*next, false);
      greedy.estimate = estimate(model_, greedy.estimate.solution.pose);
    }
    bool agree = greedy.estimate.ok() && !worst(model_);
    if (agree) agree = take_back(greedy);
    set_active(model_, greedy.removed, true);
    std::sort(greedy.removed.begin(), greedy.removed.end());
    return agree ? std::optional(std::move(greedy)) : std::nullopt;
  }

  // The first to be removed may have been good ones, shown in a bad light by the others.
  bool take_back(Explanation& greedy) {
    const double critical = critical_deviation(active_.size());
    for (std::size_t at = 0; at < greedy.removed.size();) {
      const std::size_t i = greedy.removed[at];
      if (is_wrong(model_, i, critical)) {
        ++at;
        continue;
      }
      model_.set_active(i, true);
      Estimate with = estimate(model_, greedy.estimate.solution.pose);
      if (with.ok() && !worst(model_)) {
        greedy.removed.erase(greedy.removed.begin() + static_cast<std::ptrdiff_t>(at));
      } else {
        model_.set_active(i, false);
        with = estimate(model_, greedy.estimate.solution.pose);
        ++at;
      }
      greedy.estimate = std::move(with);
    }
    return greedy.estimate.ok() && !worst(model_);
  }

  PoseModel& model_;
  const Estimate all_;
  Set active_;
  std::optional<LinearFit> fit_;
};

std::string accusation(const PoseModel& model, std::size_t i) {
  return "mark " + model.mark(i).name + " deviates by " + number(model.dev_px(i).norm()) + " px";
}

Rejection refused(PoseModel& model, Estimate& current, bool explained, std::string reason) {
  current = estimate(model, current.solution.pose);
  return {Code::deviation_not_attributable, std::move(reason), {}, explained};
}

Rejection accepted(PoseModel& model, const Explanations& found, Estimate& current) {
  const Explanation& best = found.all[found.best];
  set_active(model, best.removed, false);
  current = found.model_is_there ? best.estimate : estimate(model, best.estimate.solution.pose);
  if (!current.ok()) {
    set_active(model, best.removed, true);
    return refused(model, current, true, "the marks that are left do not lead to a pose again");
  }
  Rejection rejection{Code::ok, {}, best.removed, true};
  std::stable_sort(rejection.removed.begin(), rejection.removed.end(),
                   [&model](auto a, auto b) { return model.normalised(a) > model.normalised(b); });
  return rejection;
}

std::string unclear(const Explanations& found) {
  const std::string wrong = number(found.all[found.best].removed.size());
  if (found.all.size() == 1 && !found.rivals.empty())
    return ", but whether " + wrong + " marks are wrong or all of one camera is not clear";
  if (!found.complete)
    return ", but more than " + number(max_estimates) + " choices of " + wrong +
           " wrong marks may explain it";
  return ", but " + number(found.all.size()) + " different choices of " + wrong +
         " wrong marks explain it and the best two equally well";
}

}  // namespace

Estimate estimate(PoseModel& model, const CentredPose& start) {
  Estimate estimate;
  estimate.solution = refine(model, start);
  if (estimate.solution.status != SolverStatus::converged) return estimate;
  estimate.precision = precision_of(model, estimate.solution);
  estimate.misfit = normalise(model, estimate.precision);
  return estimate;
}

Rejection reject_wrong_marks(PoseModel& model, Estimate& current) {
  const auto suspect = worst(model);
  if (!suspect) return {Code::ok, {}, {}, true};
  const std::string accused = accusation(model, *suspect);
  Search search(model, current);
  const std::size_t largest = search.largest_set();
  const std::size_t count = search.active_count();
  for (std::size_t k = 1; k <= largest; ++k) {
    const bool all = search.can_try_all(k);
    const Explanations found = all ? search.explanations(k) : search.greedy(largest);
    if (!found.all.empty() && found.is_clear(model)) return accepted(model, found, current);
    if (!found.all.empty()) return refused(model, current, true, accused + unclear(found));
    if (!all) break;
  }
  return refused(model, current, false,
                 accused + ", and with " + number(count) + " observations no removal of up to " +
                     number(largest) + " of them makes the others agree");
}

}  // namespace zeropose
