#include "sim/robot.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>

namespace zeropose {
namespace {

using std::chrono::ceil;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr std::uint8_t read_input_registers = 4, write_multiple_registers = 16;

void put16(std::vector<std::uint8_t>& bytes, std::size_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
  bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
}

std::string refusal_by_identity(const ResultBlock& b, const RobotExpectation& e,
                                const SimulatedRobotOptions& o) {
  if (e.epoch == 0 || b.epoch != e.epoch) return "session epoch changed";
  if (e.request_id == 0 || b.request_id != e.request_id) return "foreign request id";
  if (b.request_id == e.last_used_id) return "result used already";
  if (b.robot_index != o.robot_index) return "result for another robot";
  if (b.job != e.job) return "result for another job";
  if (b.part != e.part) return "result for another part";
  if (b.convention != static_cast<std::uint16_t>(o.convention)) return "another convention";
  if (b.frame != o.frame) return "another frame of the values";
  return "";
}

std::string refusal_by_status(const ResultBlock& b) {
  using namespace status_bit;
  if ((b.status & ~all) != 0) return "unknown status bits";
  if (b.has(busy)) return "still busy";
  if (b.has(not_ok)) return b.has(result_valid) ? "status contradicts itself" : "not ok";
  if (!b.has(result_valid)) return "no valid result";
  if (b.code != 0) return "valid result with a code";
  if (b.has(error) || !b.has(ready) || !b.has(exposure_done) || b.has(zero_missing))
    return "status contradicts itself";
  if (b.state != LinkState::ready) return "state contradicts status";
  if (b.has(camera_moved)) return "a camera has moved";
  return "";
}

std::string refusal_by_age(const ResultBlock& b, const RobotExpectation& e, const SimulatedRobotOptions& o) {
  if (b.validity_ms == 0) return "no validity";
  if (milliseconds(b.age_ms) + e.since_read >= milliseconds(b.validity_ms)) return "result too old";
  if (e.since_command > o.patience) return "answer too late";
  return "";
}

}  // namespace

std::string refusal_by_limits(const Pose& correction, double max_translation_mm, double max_rotation_deg) {
  if (!(correction.translation().norm() <= max_translation_mm))
    return "beyond the robot's own limit: translation";
  if (!(log_so3(correction.linear()).norm() * degrees_per_radian <= max_rotation_deg))
    return "beyond the robot's own limit: rotation";
  return "";
}

CheckedBlock check_result(std::span<const std::uint16_t> registers, const RobotExpectation& expected,
                          const SimulatedRobotOptions& options) {
  const DecodedBlock decoded = decode_result(registers, options.result_data_id);
  if (decoded.problem) return {std::string(name_of(*decoded.problem)), {}, {}};
  const ResultBlock& block = decoded.block;
  std::string refusal = refusal_by_identity(block, expected, options);
  if (refusal.empty()) refusal = refusal_by_status(block);
  if (refusal.empty()) refusal = refusal_by_age(block, expected, options);
  if (!refusal.empty()) return {refusal, {}, block};
  const auto correction = from_wire(options.convention, block.values);
  if (!correction) return {"values are no correction", {}, block};
  refusal = refusal_by_limits(*correction, options.max_translation_mm, options.max_rotation_deg);
  if (!refusal.empty()) return {refusal, {}, block};
  return {"", correction, block};
}

SimulatedRobot::SimulatedRobot(const SimulatedRobotOptions& options)
    : options_(options), next_id_(std::max<std::uint32_t>(1, options.first_request_id)) {}

void SimulatedRobot::disconnect() { socket_ = Descriptor(); }

std::string SimulatedRobot::connect() {
  if (socket_) return "";
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_port = htons(options_.port);
  if (inet_pton(AF_INET, options_.address.c_str(), &name.sin_addr) != 1)
    return "no numeric address: " + options_.address;
  Descriptor fresh(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval limit{options_.reply_time.count() / 1000, options_.reply_time.count() % 1000 * 1000};
  const int on = 1;
  setsockopt(fresh.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);  // of connect() as well
  setsockopt(fresh.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (!fresh || ::connect(fresh.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0)
    return std::string("no connection: ") + std::strerror(errno);
  socket_ = std::move(fresh);
  return "";
}

std::string SimulatedRobot::receive(std::span<std::uint8_t> bytes, Clock::time_point until) {
  while (!bytes.empty()) {
    const auto left = ceil<milliseconds>(until - Clock::now()).count();
    pollfd ready{socket_.get(), POLLIN, 0};
    if (left <= 0 || poll(&ready, 1, static_cast<int>(left)) == 0) return "no reply in time";
    const ssize_t size = recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return "connection lost";
    bytes = bytes.subspan(static_cast<std::size_t>(size));
  }
  return "";
}

// One request, one reply; whatever goes wrong ends the connection, so that no late reply meets the next
// request.
SimulatedRobot::Reply SimulatedRobot::exchange(std::span<const std::uint8_t> pdu) {
  Reply reply;
  reply.failure = connect();
  if (!reply.failure.empty()) return reply;
  std::vector<std::uint8_t> adu;
  put16(adu, ++transaction_);
  put16(adu, 0);
  put16(adu, pdu.size() + 1);
  adu.push_back(options_.unit);
  adu.insert(adu.end(), pdu.begin(), pdu.end());
  const auto until = Clock::now() + options_.reply_time;
  std::array<std::uint8_t, 7> header{};
  if (::send(socket_.get(), adu.data(), adu.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(adu.size()))
    reply.failure = "connection lost";
  if (reply.failure.empty()) reply.failure = receive(header, until);
  const std::size_t length = static_cast<std::size_t>(header[4] << 8 | header[5]);
  if (reply.failure.empty() && (!std::equal(adu.begin(), adu.begin() + 4, header.begin()) ||
                                header[6] != options_.unit || length < 3 || length > 254))
    reply.failure = "foreign reply";
  if (reply.failure.empty()) {
    reply.pdu.resize(length - 1);
    reply.failure = receive(reply.pdu, until);
  }
  if (reply.failure.empty() && (reply.pdu[0] & 0x7F) != pdu[0]) reply.failure = "foreign reply";
  if (!reply.failure.empty()) {
    disconnect();
  } else if (reply.pdu[0] & 0x80) {
    reply.exception = reply.pdu[1];
    reply.failure = "exception " + std::to_string(reply.exception);
  }
  return reply;
}

bool SimulatedRobot::read_registers(std::size_t first, std::size_t count,
                                    std::vector<std::uint16_t>& registers, RobotAnswer& answer) {
  std::vector<std::uint8_t> pdu{read_input_registers};
  put16(pdu, first);
  put16(pdu, count);
  const Reply reply = exchange(pdu);
  answer.exception = reply.exception;
  answer.refusal = reply.failure;
  if (!reply.failure.empty()) return false;
  registers.clear();
  for (std::size_t i = 2; i + 1 < reply.pdu.size(); i += 2)
    registers.push_back(static_cast<std::uint16_t>(reply.pdu[i] << 8 | reply.pdu[i + 1]));
  return true;
}

bool SimulatedRobot::read_block(std::vector<std::uint16_t>& registers, RobotAnswer& answer) {
  if (!read_registers(0, reg::block_size, registers, answer)) return false;
  const DecodedBlock decoded = decode_result(registers, options_.result_data_id);
  if (decoded.problem) answer.refusal = name_of(*decoded.problem);
  if (!decoded.problem) answer.block = decoded.block;
  return !decoded.problem;
}

RobotAnswer SimulatedRobot::write(std::uint16_t first, std::span<const std::uint16_t> registers) {
  std::vector<std::uint8_t> pdu{write_multiple_registers};
  put16(pdu, first);
  put16(pdu, registers.size());
  pdu.push_back(static_cast<std::uint8_t>(2 * registers.size()));
  for (const std::uint16_t value : registers) put16(pdu, value);
  const Reply reply = exchange(pdu);
  RobotAnswer answer;
  answer.refusal = reply.failure;
  answer.exception = reply.exception;
  return answer;
}

RobotAnswer SimulatedRobot::send(const Command& command) {
  commanded_ = Clock::now();
  RobotAnswer answer = write(command_reg::first, encode_command(command, options_.command_data_id));
  answer.request_id = command.request_id;
  return answer;
}

RobotAnswer SimulatedRobot::command(CommandKind kind, std::uint16_t job, std::uint32_t part,
                                    std::int32_t argument, milliseconds patience) {
  RobotAnswer before;
  std::vector<std::uint16_t> registers;
  if (!read_block(registers, before)) return before;
  RobotExpectation expected;
  expected.request_id = next_id_++;
  if (next_id_ == 0) next_id_ = 1;
  expected.epoch = before.block.epoch;
  expected.job = job;
  expected.part = part;
  expected.last_used_id = last_used_id_;
  last_id_ = expected.request_id;
  RobotAnswer sent = send({expected.request_id, static_cast<std::uint16_t>(kind), job, part, argument});
  if (!sent.ok()) return sent;
  return wait_for_answer(kind, expected, patience);
}

RobotAnswer SimulatedRobot::wait_for_answer(CommandKind kind, RobotExpectation expected,
                                            milliseconds patience) {
  RobotAnswer answer;
  answer.request_id = expected.request_id;
  std::vector<std::uint16_t> registers;
  while (true) {
    const auto read_started = Clock::now();
    if (!read_block(registers, answer)) return answer;
    const ResultBlock& block = answer.block;
    const auto elapsed = std::chrono::duration_cast<microseconds>(Clock::now() - commanded_);
    if (block.has(status_bit::exposure_done) && !answer.to_exposure_done) answer.to_exposure_done = elapsed;
    const bool waiting = block.has(status_bit::busy) && block.request_id == expected.request_id &&
                         block.epoch == expected.epoch && elapsed <= patience;
    if (!waiting) {
      answer.to_answer = elapsed;
      judge(kind, expected, registers, read_started, answer);
      return answer;
    }
    std::this_thread::sleep_for(options_.poll_period);
  }
}

void SimulatedRobot::judge(CommandKind kind, RobotExpectation expected,
                           std::span<const std::uint16_t> registers, Clock::time_point read_started,
                           RobotAnswer& answer) {
  const ResultBlock& block = answer.block;
  answer.code = block.code;
  if (kind == CommandKind::measure) {
    expected.since_read = ceil<milliseconds>(Clock::now() - read_started);
    expected.since_command = ceil<milliseconds>(Clock::now() - commanded_);
    const CheckedBlock checked = check_result(registers, expected, options_);
    answer.refusal = checked.refusal;
    answer.correction = checked.correction;
    if (checked.correction) last_used_id_ = expected.request_id;
    return;
  }
  answer.refusal = refusal_by_identity(block, expected, options_);
  if (!answer.refusal.empty()) return;
  if (block.has(status_bit::busy)) answer.refusal = "still busy";
  if (block.has(status_bit::not_ok)) answer.refusal = "not ok";
  if (block.has(status_bit::result_valid)) answer.refusal = "a correction that was not asked for";
  if (answer.refusal.empty() && block.code != 0) answer.refusal = "done with a code";
}

RobotAnswer SimulatedRobot::measure(std::uint16_t job, std::uint32_t part, std::int32_t axis_position_um) {
  return command(CommandKind::measure, job, part, axis_position_um, options_.patience);
}

RobotAnswer SimulatedRobot::zero(std::uint16_t job) {
  return command(CommandKind::zero, job, 0, zero_guard, options_.zero_patience);
}

RobotAnswer SimulatedRobot::at_position(std::uint16_t job, std::uint32_t part, std::int32_t position,
                                        const Pose& X_RH) {
  const auto values = to_wire(options_.convention, X_RH);
  if (!values) return {};
  RobotAnswer told =
      write(position_reg::first,
            encode_position({static_cast<std::uint32_t>(position), *values}, options_.command_data_id));
  if (!told.ok()) return told;
  return command(CommandKind::at_position, job, part, position, options_.zero_patience);
}

std::optional<HandTarget> SimulatedRobot::target() {
  RobotAnswer answer;
  std::vector<std::uint16_t> block, registers;
  if (!read_block(block, answer) ||
      !read_registers(target_reg::first, target_reg::block_size, registers, answer))
    return std::nullopt;
  if (answer.block.robot_index != options_.robot_index ||
      answer.block.convention != static_cast<std::uint16_t>(options_.convention) ||
      answer.block.has(status_bit::error) || answer.block.state == LinkState::halted)
    return std::nullopt;
  const auto target = decode_target(registers, options_.result_data_id);
  if (!target || target->index == 0 || target->epoch != answer.block.epoch) return std::nullopt;
  const auto X_RH = from_wire(options_.convention, target->values);
  return X_RH ? std::optional(HandTarget{target->index, *X_RH}) : std::nullopt;
}

RobotAnswer SimulatedRobot::select_job(std::uint16_t job) {
  return command(CommandKind::select_job, job, 0, 0, options_.patience);
}

RobotAnswer SimulatedRobot::reset() { return command(CommandKind::reset, 0, 0, 0, options_.patience); }
RobotAnswer SimulatedRobot::halt() { return command(CommandKind::halt, 0, 0, 0, options_.patience); }
RobotAnswer SimulatedRobot::resume() { return command(CommandKind::resume, 0, 0, 0, options_.patience); }

RobotAnswer SimulatedRobot::acknowledge() {
  RobotAnswer answer = send({last_id_, static_cast<std::uint16_t>(CommandKind::acknowledge), 0, 0, 0});
  std::vector<std::uint16_t> registers;
  if (!answer.ok() || !read_block(registers, answer)) return answer;
  if (answer.block.request_id == last_id_) answer.refusal = "result still there after Acknowledge";
  return answer;
}

RobotAnswer SimulatedRobot::heartbeat() {
  const std::uint32_t id = next_id_++;
  if (next_id_ == 0) next_id_ = 1;
  return send({id, static_cast<std::uint16_t>(CommandKind::heartbeat), 0, 0, 0});
}

RobotAnswer SimulatedRobot::read() {
  RobotAnswer answer;
  std::vector<std::uint16_t> registers;
  read_block(registers, answer);
  return answer;
}

}  // namespace zeropose
