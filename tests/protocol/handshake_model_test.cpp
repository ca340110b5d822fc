// Random operations against an independent model: the model keeps the history and asks of every block whether
// it may be so. It knows nothing of how the handshake works.
#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

#include "protocol/handshake.h"
#include "tests/protocol/amount.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds deadline{50}, validity{80};

struct Sent {
  Request request;
  ConnectionId from = 0;
  CellState cell;
  bool answered = false;  // a report in time, or the deadline
  bool orphaned = false;
  TimePoint answered_at;
  bool ok = false;
  std::int32_t value_um = 0;
  bool withdrawn = false;
};

struct Delayed {
  Report report;
  TimePoint due;
  std::size_t incarnation;
};

class Model {
 public:
  explicit Model(std::uint64_t seed, bool chaos) : random_(seed), chaos_(chaos), handshake_(options()) {
    set_cell(true, 1);
  }

  void step() {
    now_ += milliseconds(pick(4));
    deliver_due();
    switch (pick(12)) {
      case 0:
      case 1:
      case 2:
      case 3:
        send(CommandKind::measure);
        break;
      case 4:
        send(CommandKind::acknowledge);
        break;
      case 5:
        send(static_cast<CommandKind>(pick(12)));
        break;
      case 6:
        disconnect(1 + pick(3));
        break;
      case 7:
        set_cell(pick(4) != 0, static_cast<std::uint32_t>(1 + pick(2)));
        break;
      case 8:
        foreign_report();
        break;
      case 9:
        handshake_.on_exposure_done(static_cast<std::uint32_t>(pick(12)), now_);
        break;
      default:
        now_ += milliseconds(pick(30));
        break;
    }
    check();
  }

  std::size_t valid_seen = 0, busy_seen = 0, timeouts_seen = 0, reused_ids = 0;

 private:
  static HandshakeOptions options() {
    HandshakeOptions o;
    o.measure_deadline = o.zero_deadline = deadline;
    o.validity = validity;
    return o;
  }
  std::size_t pick(std::size_t n) { return random_() % n; }

  // Time passes for the model: the deadline and the end of validity are history by themselves.
  void settle() {
    if (sent_.empty()) return;
    Sent& last = sent_.back();
    if (!last.answered && now_ >= last.request.deadline) {
      last.answered = true;
      last.ok = false;
      ++timeouts_seen;
    }
  }

  bool executing() const { return !sent_.empty() && !sent_.back().answered; }

  void send(CommandKind kind) {
    settle();
    const ConnectionId from = 1 + pick(3);
    const auto id = static_cast<std::uint32_t>(pick(12));  // few ids: duplicates, replays, 0
    const std::int32_t argument = kind == CommandKind::zero && pick(2) ? zero_guard : 0;
    const auto outcome =
        handshake_.on_command({id, static_cast<std::uint16_t>(kind), 1, 2, argument}, from, now_);
    if (executing()) {
      ASSERT_EQ(outcome.verdict, CommandVerdict::busy);
      ++busy_seen;
      return;
    }
    ASSERT_NE(outcome.verdict, CommandVerdict::busy);
    if (kind == CommandKind::acknowledge) {
      const bool fits = id != 0 && id == last_id_ && owner_ == from;
      ASSERT_EQ(outcome.verdict == CommandVerdict::accepted, fits);
      if (fits) withdraw();
      return;
    }
    if (id == 0 || id == last_id_) {
      ASSERT_EQ(outcome.verdict, CommandVerdict::wrong_request_id);
      return;
    }
    if (outcome.verdict != CommandVerdict::accepted || kind == CommandKind::heartbeat) return;
    accepted(kind, id, from, outcome);
  }

  void accepted(CommandKind kind, std::uint32_t id, ConnectionId from, const CommandOutcome& outcome) {
    withdraw();
    last_id_ = id;
    owner_ = from;
    if (!outcome.request || kind == CommandKind::reset) return;
    if (!used_ids_.insert(id).second) ++reused_ids;
    ASSERT_EQ(outcome.request->id, id);
    ASSERT_EQ(outcome.request->kind, kind);
    Sent sent;
    sent.request = *outcome.request;
    sent.from = from;
    sent.cell = cell_;
    sent_.push_back(sent);
    schedule(*outcome.request);
  }

  // What a cycle may do to a request: answer in time, late, never, twice, out of order.
  void schedule(const Request& request) {
    Report report;
    report.request_id = request.id;
    report.ticket = chaos_ ? request.ticket : 0;
    report.code = pick(4) ? Code::ok : Code::too_few_marks;
    report.correction.translation().x() = static_cast<double>(sent_.size()) * 1e-3;  // the incarnation, in um
    const std::size_t fate = pick(100);
    if (fate == 0) return;
    const auto delay = milliseconds(fate < 10 ? 50 + pick(200) : pick(45));
    delayed_.push_back({report, now_ + delay, sent_.size() - 1});
    if (chaos_ && fate < 50) delayed_.push_back({report, now_ + milliseconds(pick(300)), sent_.size() - 1});
  }

  void deliver_due() {
    for (std::size_t i = 0; i < delayed_.size();) {
      if (delayed_[i].due > now_) {
        ++i;
        continue;
      }
      deliver(delayed_[i]);
      delayed_[i] = delayed_.back();
      delayed_.pop_back();
    }
  }

  void deliver(const Delayed& delayed) {
    settle();
    handshake_.on_report(delayed.report, now_);
    Sent& of = sent_[delayed.incarnation];
    if (of.answered) return;
    of.answered = true;
    of.answered_at = now_;
    of.ok = delayed.report.code == Code::ok && cell_.cameras_alive && cell_.zero_id == of.cell.zero_id;
    of.value_um = static_cast<std::int32_t>(delayed.incarnation) + 1;
  }

  void foreign_report() {
    settle();
    Report report;
    report.request_id = static_cast<std::uint32_t>(100 + pick(5));
    report.code = Code::ok;
    report.correction.translation().x() = 1e3;
    handshake_.on_report(report, now_);
  }

  void withdraw() {
    if (!sent_.empty()) sent_.back().withdrawn = true;
  }

  void disconnect(ConnectionId connection) {
    settle();
    handshake_.on_disconnect(connection, now_);
    if (owner_ != connection) return;
    if (executing()) sent_.back().orphaned = true;
    withdraw();
    owner_ = 0;
    ++epoch_;
  }

  void set_cell(bool alive, std::uint32_t zero_id) {
    settle();
    const CellState cell{true, alive, true, false, 1, 2, zero_id};
    handshake_.set_cell_state(cell, now_);
    const bool changed = cell.zero_id != cell_.zero_id || !alive;
    cell_ = cell;
    if (changed && !executing()) withdraw();
  }

  bool may_be_valid() const {
    if (sent_.empty()) return false;
    const Sent& last = sent_.back();
    return last.request.kind == CommandKind::measure && last.answered && last.ok && !last.withdrawn &&
           now_ < last.answered_at + validity;
  }

  void check() {
    settle();
    const ResultBlock b = handshake_.block(now_);
    ASSERT_EQ(b.epoch, epoch_);
    ASSERT_EQ(b.has(status_bit::busy), executing());
    ASSERT_EQ(b.has(status_bit::result_valid), may_be_valid());
    ASSERT_FALSE(b.has(status_bit::result_valid) && b.has(status_bit::not_ok));
    if (!b.has(status_bit::result_valid)) {
      ASSERT_EQ(b.values, no_values);
      return;
    }
    const Sent& last = sent_.back();
    ASSERT_EQ(b.request_id, last.request.id);
    ASSERT_EQ(b.values[0], last.value_um);
    ASSERT_EQ(b.code, 0);
    ASSERT_EQ(b.zero_id, last.cell.zero_id);
    ++valid_seen;
  }

  std::mt19937_64 random_;
  bool chaos_;
  TimePoint now_ = TimePoint() + std::chrono::hours(1);
  Handshake handshake_;
  std::vector<Sent> sent_;
  std::vector<Delayed> delayed_;
  std::set<std::uint32_t> used_ids_;
  CellState cell_;
  std::uint32_t last_id_ = 0, epoch_ = 1;
  ConnectionId owner_ = 0;
};

void run(std::uint64_t seed, bool chaos, std::size_t operations) {
  Model model(seed, chaos);
  for (std::size_t i = 0; i < operations; ++i) {
    model.step();
    if (testing::Test::HasFatalFailure()) {
      ADD_FAILURE() << "at operation " << i;
      return;
    }
  }
  // The test would pass without teeth if nothing ever happened.
  EXPECT_GT(model.valid_seen, operations / 100);
  EXPECT_GT(model.busy_seen, operations / 100);
  EXPECT_GT(model.timeouts_seen, operations / 1000);
  EXPECT_GT(model.reused_ids, operations / 100);
}

// Reports are doubled, late, out of order, and come for ids used again: the ticket tells them apart.
TEST(HandshakeModel, RandomOperationsWithTickets) { run(20, true, amount(600000)); }

// A cycle that copies the id only and reports each request at most once, but as late as it likes.
TEST(HandshakeModel, RandomOperationsWithIdsOnly) { run(21, false, amount(600000)); }

}  // namespace
}  // namespace zeropose
