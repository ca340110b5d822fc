#include "tests/support/answering_cell.h"

#include <iostream>

namespace zeropose {
namespace {

Report report_for(const Request& request) {
  Report report;
  report.request_id = request.id;
  report.ticket = request.ticket;
  report.code = request.job == 2 ? Code::too_few_marks : Code::ok;
  const double x_mm = request.job == 4 ? 400.0 : 12.345;
  report.correction = from_six_numbers({x_mm, -6.789, 0.001, 0.1234, -0.5678, 30.25});
  report.effective_marks = 11;
  report.effective_cameras = 4;
  report.largest_deviation_mm = 0.25;
  report.sigma_mm = 0.031;
  return report;
}

}  // namespace

AnsweringCell::AnsweringCell(const AnsweringCellOptions& options)
    : options_(options),
      recorder_({Convention::kuka, 2, default_result_data_id}),
      endpoint_(endpoint_options(), [this](const Request& request) { take(request); }),
      thread_([this] { run(); }) {
  endpoint_.set_cell_state(state_);
}

AnsweringCell::~AnsweringCell() {
  if (thread_.joinable()) finish();
}

EndpointOptions AnsweringCell::endpoint_options() {
  EndpointOptions options;
  options.handshake.convention = Convention::kuka;
  options.handshake.frame = 3;
  options.handshake.robot_index = 2;
  options.handshake.validity = options_.validity;
  options.handshake.measure_deadline = options_.measure_deadline;
  options.tap = recorder_.tap();
  return options;
}

int AnsweringCell::finish() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
  }
  came_.notify_one();
  thread_.join();
  for (const std::string& violation : recorder_.violations()) std::cerr << violation << '\n';
  std::cerr << recorder_.valid_blocks() << " valid blocks published\n";
  return recorder_.violations().empty() ? 0 : 1;
}

void AnsweringCell::take(const Request& request) {
  if (request.kind == CommandKind::measure) recorder_.requested(request.id);
  const std::scoped_lock lock(mutex_);
  requests_.push_back(request);
  came_.notify_one();
}

// One request at a time, as the link promises.
void AnsweringCell::run() {
  for (;;) {
    std::unique_lock lock(mutex_);
    came_.wait(lock, [this] { return stopping_ || !requests_.empty(); });
    if (stopping_) return;
    const Request request = requests_.front();
    requests_.pop_front();
    lock.unlock();
    if (request.kind != CommandKind::reset && request.job != 3) answer(request);
  }
}

void AnsweringCell::answer(const Request& request) {
  std::this_thread::sleep_for(options_.to_exposure);
  endpoint_.exposure_done(request.id);
  std::this_thread::sleep_for(options_.to_answer);
  if (request.kind == CommandKind::zero) {
    state_.zero_id = 0x0A0B0C0D;
    endpoint_.set_cell_state(state_);
  }
  const Report report = report_for(request);
  recorder_.reported(report);
  endpoint_.publish(report);
}

}  // namespace zeropose
