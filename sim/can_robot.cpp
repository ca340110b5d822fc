#include "sim/can_robot.h"

#include <poll.h>

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

using std::chrono::ceil;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::uint16_t session = 0x2001;
constexpr std::uint8_t session_epoch = 1, session_validity = 10;
constexpr milliseconds sdo_patience{1000};

std::string refusal_by_status(const CanResult& result) {
  using namespace can_status;
  if (result.has(not_ok)) return result.has(valid) ? "status contradicts itself" : "not ok";
  if (!result.has(valid)) return "no valid result";
  if (result.code != 0) return "valid result with a code";
  if (result.has(error) || result.has(attention)) return "status contradicts itself";
  return "";
}

std::optional<Pose> correction_of(const CanValues& values, const CanCoding& coding, Convention convention) {
  WireValues wire = no_values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] == invalid_can_value) return std::nullopt;
    const double scale = i < 3 ? coding.length_scale : coding.angle_scale;
    wire[i] = static_cast<std::int32_t>(std::lround(scale * values[i]));
  }
  return from_wire(convention, wire);
}

}  // namespace

SimulatedCanRobot::SimulatedCanRobot(const SimulatedCanRobotOptions& options)
    : options_(options),
      coding_(can_coding(options.can, options.convention)),
      socket_(options.can.interface, coding_.node, false),
      collector_(coding_),
      next_id_(std::max<std::uint16_t>(1, options.first_request_id)) {}

std::optional<CanFrame> SimulatedCanRobot::receive(Clock::time_point until) {
  for (;;) {
    CanReceived received;
    if (socket_.receive(received) == CanIo::done) {
      if (!received.own_echo) return received.frame;
      continue;
    }
    const auto left = ceil<milliseconds>(until - Clock::now()).count();
    pollfd ready{socket_.descriptor(), POLLIN, 0};
    if (left <= 0 || poll(&ready, 1, static_cast<int>(left)) <= 0) return std::nullopt;
  }
}

std::optional<std::uint32_t> SimulatedCanRobot::read(std::uint16_t index, std::uint8_t sub) {
  CanFrame request;
  request.id = can_id::sdo_request + coding_.node;
  request.size = 8;
  request.data[0] = 0x40;  // initiate upload
  put_le(request.data, 1, 2, index);
  request.data[3] = sub;
  socket_.send(request);
  const auto until = Clock::now() + sdo_patience;
  while (const auto frame = receive(until)) {
    const bool answers =
        frame->id == can_id::sdo_answer + coding_.node && frame->size == 8 &&
        std::equal(request.data.begin() + 1, request.data.begin() + 4, frame->data.begin() + 1);
    if (!answers) continue;
    if ((frame->data[0] & 0xE3) != 0x43) return std::nullopt;  // not expedited with its size: an abort
    return get_le(frame->data, 4, 4U - (frame->data[0] >> 2 & 3U));
  }
  return std::nullopt;
}

void SimulatedCanRobot::send(const Command& command) {
  socket_.send(encode_can_command(command, coding_.node));
}

RobotAnswer SimulatedCanRobot::measure(std::uint8_t job, std::uint32_t part) {
  RobotAnswer answer;
  const auto epoch = read(session, session_epoch), validity = read(session, session_validity);
  if (!epoch || !validity) {
    answer.refusal = "no reply on " + options_.can.interface;
    return answer;
  }
  last_id_ = std::exchange(next_id_, static_cast<std::uint16_t>(next_id_ == 0xFFFF ? 1 : next_id_ + 1));
  answer.request_id = last_id_;
  collector_.expect(last_id_, *epoch);
  commanded_ = Clock::now();
  send({last_id_, static_cast<std::uint16_t>(CommandKind::measure), job, part, 0});
  answer.refusal = "no answer in time";
  while (const auto frame = receive(commanded_ + options_.patience)) {
    const auto result = collector_.take(*frame, Clock::now());
    if (!result) continue;
    answer = judged(*result, milliseconds(*validity));
    break;
  }
  answer.request_id = last_id_;
  answer.to_answer = std::chrono::duration_cast<microseconds>(Clock::now() - commanded_);
  return answer;
}

RobotAnswer SimulatedCanRobot::judged(const CanResult& result, milliseconds validity) const {
  RobotAnswer answer;
  answer.code = result.code;
  answer.refusal = refusal_by_status(result);
  if (answer.refusal.empty() && Clock::now() - commanded_ >= std::min(validity, options_.patience))
    answer.refusal = "result too old";
  if (!answer.refusal.empty()) return answer;
  const auto correction = correction_of(result.values, coding_, options_.convention);
  answer.refusal =
      correction ? refusal_by_limits(*correction, options_.max_translation_mm, options_.max_rotation_deg)
                 : "values are no correction";
  if (answer.ok()) answer.correction = correction;
  return answer;
}

void SimulatedCanRobot::acknowledge() {
  send({last_id_, static_cast<std::uint16_t>(CommandKind::acknowledge), 0, 0, 0});
}

}  // namespace zeropose
