#include "protocol/register_map.h"

#include <array>
#include <sstream>

#include "protocol/codec.h"
#include "protocol/conventions.h"

namespace zeropose {
namespace {

constexpr std::array<RegisterField, 26> result_fields{{
    {reg::magic, 1, "magic", "0x5A50"},
    {reg::map_version, 1, "map version", "1"},
    {reg::sequence_begin, 1, "sequence (begin)", "counts the published blocks; equal to register 60"},
    {reg::epoch, 2, "session epoch", "changes at start-up and when the owner's connection is lost; never 0"},
    {reg::request_id, 2, "request id", "of the request under way or of the answer; 0: neither"},
    {reg::job, 1, "job", "as in the command"},
    {reg::robot_index, 1, "robot index", "1.. in the order of the config"},
    {reg::part, 2, "part id", "as in the command"},
    {reg::state, 1, "state",
     "0 Preoperational, 1 Initialized, 2 Ready, 3 SingleExecution, 4 Halted, 5 Error"},
    {reg::status, 1, "status bits",
     "0 ready, 1 busy, 2 exposure done, 3 result valid, 4 not ok, 5 error, 6 simulated, 7 zero missing, "
     "8 camera moved"},
    {reg::code, 1, "code", "0 ok, else why not"},
    {reg::values, 2 * reg::value_count, "values",
     "up to 8, signed 32 bit; 0x80000000 while there is no valid result, and where unused"},
    {reg::convention, 1, "convention", "number of the robot maker's convention, see below"},
    {reg::frame, 1, "frame of the values",
     "0 none, 1 object zero, 2 world shift, 3 robot-base shift, 4 user frame"},
    {reg::age, 1, "age", "ms since the answer was published, rounded up; 65535: none, or older"},
    {reg::validity, 1, "validity", "ms from publication until the result is withdrawn"},
    {reg::marks, 1, "effective marks", "that took part in the estimate"},
    {reg::cameras, 1, "effective cameras", "that took part in the estimate"},
    {reg::deviation, 1, "largest deviation", "um, rounded up; 65535: none, or beyond"},
    {reg::sigma, 1, "sigma at the worst application point", "um, rounded up; 65535: none, or beyond"},
    {reg::config_hash, 2, "config hash", "first four bytes of the file's SHA-256"},
    {reg::calibration_hash, 2, "calibration hash", "first four bytes of the file's SHA-256"},
    {reg::zero_id, 2, "zero id", "of the zero measurement in use"},
    {reg::spare, reg::crc - reg::spare, "spare", "0"},
    {reg::crc, 2, "CRC-32", "over the data id 0x5A50 (not on the wire) and registers 0..57"},
    {reg::sequence_end, 1, "sequence (end)", "equal to register 2"},
}};

constexpr std::size_t at(std::size_t offset) { return command_reg::first + offset; }

constexpr std::array<RegisterField, 6> command_fields{{
    {at(command_reg::request_id), 2, "request id", "chosen by the robot; not 0, not the last one again"},
    {at(command_reg::command), 1, "command", "number, see below"},
    {at(command_reg::job), 1, "job", "number as in the cell file"},
    {at(command_reg::part), 2, "part id", "free; comes back in the answer"},
    {at(command_reg::argument), 2, "argument", "see below, else 0"},
    {at(command_reg::crc), 2, "CRC-32",
     "over the data id 0x5A51 (not on the wire) and the eight registers before"},
}};

constexpr std::size_t position_at(std::size_t offset) { return position_reg::first + offset; }

constexpr std::array<RegisterField, 3> position_fields{{
    {position_at(position_reg::index), 2, "index",
     "of the position; the argument of AtPosition names it again"},
    {position_at(position_reg::values), 2 * reg::value_count, "values",
     "pose of the robot's hand in its base (X_RH), in the robot's convention; 0x80000000 where unused"},
    {position_at(position_reg::crc), 2, "CRC-32",
     "over the data id 0x5A51 (not on the wire) and the eighteen registers before"},
}};

constexpr std::size_t target_at(std::size_t offset) { return target_reg::first + offset; }

constexpr std::array<RegisterField, 4> target_fields{{
    {target_at(target_reg::epoch), 2, "session epoch", "that of the result block"},
    {target_at(target_reg::index), 2, "index", "of the position to go to; 0: none"},
    {target_at(target_reg::values), 2 * reg::value_count, "values",
     "where the robot's hand shall be in its base (X_RH), in the robot's convention; 0x80000000 where "
     "unused"},
    {target_at(target_reg::crc), 2, "CRC-32",
     "over the data id 0x5A50 (not on the wire) and the twenty registers before"},
}};

std::string rows(std::span<const RegisterField> fields) {
  std::ostringstream text;
  text << "| register | field | meaning |\n|---|---|---|\n";
  for (const RegisterField& field : fields) {
    text << "| " << field.first;
    if (field.count > 1) text << '-' << field.first + field.count - 1;
    text << " | " << field.name << " | " << field.meaning << " |\n";
  }
  return text.str();
}

std::string_view unit_of(Convention convention) {
  if (convention == Convention::abb) return "um; quaternion 1e-9, q1 = w";
  if (convention == Convention::universal_robots) return "um (not m); rotation vector 1e-6 rad";
  return "um; 0.0001 deg";
}

}  // namespace

std::span<const RegisterField> result_block_fields() { return result_fields; }

std::span<const RegisterField> command_block_fields() { return command_fields; }

std::span<const RegisterField> position_block_fields() { return position_fields; }

std::span<const RegisterField> target_block_fields() { return target_fields; }

std::string register_map_markdown() {
  return "Result block: input registers (FC04), the same as holding registers (FC03).\n\n" +
         rows(result_block_fields()) + "\nCommand block: holding registers (FC16).\n\n" +
         rows(command_block_fields()) + "\nPosition block: holding registers (FC16).\n\n" +
         rows(position_block_fields()) +
         "\nTarget block: input registers (FC04), the same as holding registers (FC03).\n\n" +
         rows(target_block_fields());
}

std::string wire_values_markdown() {
  std::ostringstream text;
  text << "| number | convention | values in order | units on the wire |\n|---|---|---|---|\n";
  for (const Convention convention : all_conventions()) {
    if (convention == Convention::matrix) continue;
    text << "| " << static_cast<int>(convention) << " | " << name_of(convention) << " |";
    for (const auto field : field_names(convention)) text << ' ' << field;
    text << " | " << unit_of(convention) << " |\n";
  }
  return text.str();
}

}  // namespace zeropose
