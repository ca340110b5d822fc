// How a robot is reached: every type of link, and keys that do not belong to it.
#include "protocol/link_options.h"

#include <gmock/gmock.h>

#include "tests/config/example_cell.h"

namespace zeropose {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Json with_link(const Json& link) {
  Json json = example();
  json["robots"][0]["link"] = link;
  return json;
}

template <class Link>
Link read(const Json& json) {
  const Cell cell = parse_cell({json.dump(), "", example_calibration_text(), ""});
  return std::get<Link>(cell.robots.at(0).link);
}

TEST(RobotLink, SerialLine) {
  Json json = with_link({{"type", "modbus-rtu"},
                         {"device", "/dev/ttyS1"},
                         {"baud", 115200},
                         {"parity", "odd"},
                         {"stop_bits", 2},
                         {"unit", 247},
                         {"gap_tolerance_ms", 20}});
  json["robots"][0]["require_command_crc"] = false;
  json["robots"][0]["result_data_id"] = 7;
  const auto rtu = read<ModbusRtuOptions>(json);
  EXPECT_EQ(rtu.line.device, "/dev/ttyS1");
  EXPECT_EQ(rtu.line.baud, 115200);
  EXPECT_EQ(rtu.line.parity, 'O');
  EXPECT_EQ(rtu.line.stop_bits, 2);
  EXPECT_EQ(rtu.unit.unit, 247);
  EXPECT_EQ(rtu.unit.result_data_id, 7);
  EXPECT_EQ(rtu.unit.command_data_id, default_command_data_id);
  EXPECT_FALSE(rtu.unit.require_command_crc);
  EXPECT_EQ(rtu.gap_tolerance, std::chrono::milliseconds(20));
  EXPECT_EQ(describe(rtu), "Modbus RTU /dev/ttyS1 at 115200 baud unit 247");
}

TEST(RobotLink, ControllerThatIsTheServer) {
  const auto client = read<ModbusClientOptions>(with_link({{"type", "modbus-client"},
                                                           {"address", "10.0.0.5"},
                                                           {"port", 502},
                                                           {"unit", 247},
                                                           {"command_address", 1},
                                                           {"result_address", 100},
                                                           {"life_address", 200},
                                                           {"poll_ms", 5},
                                                           {"heartbeat_ms", 300},
                                                           {"response_timeout_ms", 50},
                                                           {"max_registers", 32}}));
  EXPECT_EQ(std::get<ModbusTcpAddress>(client.where).address, "10.0.0.5");
  EXPECT_EQ(std::get<ModbusTcpAddress>(client.where).port, 502);
  EXPECT_EQ(client.command_address, 1);
  EXPECT_EQ(client.result_address, 100);
  EXPECT_EQ(client.life_address, 200);
  EXPECT_EQ(client.poll_period, std::chrono::milliseconds(5));
  EXPECT_EQ(client.heartbeat_period, std::chrono::milliseconds(300));
  EXPECT_EQ(client.response_timeout, std::chrono::milliseconds(50));
  EXPECT_EQ(client.max_registers, 32u);
  const auto serial =
      read<ModbusClientOptions>(with_link({{"type", "modbus-client"}, {"device", "/dev/ttyS0"}}));
  EXPECT_EQ(std::get<SerialLine>(serial.where).device, "/dev/ttyS0");
  EXPECT_EQ(describe(serial), "Modbus client of /dev/ttyS0 at 19200 baud unit 1");
}

TEST(RobotLink, CanBus) {
  const auto can = read<CanOptions>(with_link({{"type", "can"},
                                               {"interface", "can1"},
                                               {"node", 5},
                                               {"fd", true},
                                               {"heartbeat_ms", 0},
                                               {"length_scale_um", 20},
                                               {"angle_scale_deg", 0.01},
                                               {"start_at_once", false}}));
  EXPECT_EQ(can.interface, "can1");
  EXPECT_EQ(can.node, 5);
  EXPECT_TRUE(can.fd);
  EXPECT_EQ(can.heartbeat, std::chrono::milliseconds(0));
  EXPECT_EQ(can.length_scale_um, 20);
  EXPECT_EQ(can.angle_scale_deg, 0.01);
  EXPECT_FALSE(can.start_at_once);
  EXPECT_EQ(describe(can), "CAN FD can1 node 5");
}

TEST(RobotLink, AKeyOfAnotherTypeIsNamed) {
  Json json = with_link({{"type", "can"}, {"interface", "can0"}, {"port", 1502}});
  json["robots"][0]["allowed_writers"] = {"10.0.0.1"};
  EXPECT_THAT(
      mistakes_in(json),
      testing::UnorderedElementsAre(
          "cell.json: robots[0].link.port: found a key of another type of link, expected no such key with "
          "type can",
          "cell.json: robots[0].allowed_writers: found a list of addresses, expected no such key with a link "
          "that is not modbus-tcp"));
}

TEST(RobotLink, WhatATypeNeedsMustBeThere) {
  EXPECT_THAT(
      mistakes_in(with_link({{"type", "modbus-tcp"}})),
      ElementsAre("cell.json: robots[0].link.address: found nothing, expected an IPv4 address such as "
                  "192.168.10.11",
                  "cell.json: robots[0].link.port: found nothing, expected an integer from 1 to 65535"));
  EXPECT_THAT(mistakes_in(with_link({{"type", "modbus-rtu"}})),
              ElementsAre("cell.json: robots[0].link.device: found nothing, expected a serial device such as "
                          "/dev/serial/by-id/..."));
  EXPECT_THAT(
      mistakes_in(with_link({{"type", "can"}})),
      ElementsAre("cell.json: robots[0].link.interface: found nothing, expected a CAN interface such as "
                  "can0"));
}

TEST(RobotLink, ABaudRateThatLinesDoNotHave) {
  const auto mistakes =
      mistakes_in(with_link({{"type", "modbus-rtu"}, {"device", "/dev/ttyS0"}, {"baud", 20000}}));
  ASSERT_EQ(mistakes.size(), 1u);
  EXPECT_THAT(mistakes[0], testing::HasSubstr("robots[0].link.baud: found 20000"));
  EXPECT_THAT(mistakes[0], testing::HasSubstr("19200"));
}

TEST(RobotLink, TwoRobotsOfOnePlace) {
  Json json = with_link({{"type", "can"}, {"interface", "can0"}, {"node", 5}});
  json["robots"].push_back(json["robots"][0]);
  json["robots"][1]["name"] = "robot2";
  EXPECT_THAT(mistakes_in(json), ElementsAre("cell.json: robots[1].link.node: found can0 node 5, as in "
                                             "robots[0].link, expected a node of its own for each robot"));
  json["robots"][1]["link"] = {{"type", "modbus-tcp"}, {"address", "127.0.0.1"}, {"port", 1502}};
  EXPECT_THAT(mistakes_in(json), IsEmpty());
}

TEST(RobotLink, AQuaternionDoesNotFitIntoACanFrame) {
  Json json = with_link({{"type", "can"}, {"interface", "can0"}});
  json["robots"][0]["convention"] = "abb";
  EXPECT_THAT(mistakes_in(json),
              ElementsAre("cell.json: robots[0].convention: found \"abb\", expected a convention "
                          "with three lengths and three angles for a link of type can"));
}

TEST(RobotLink, AnglesThatWouldNeverFitIntoACanFrame) {
  Json json = with_link({{"type", "can"}, {"interface", "can0"}});
  for (const char* convention : {"kawasaki", "comau", "adept", "doosan"}) {
    json["robots"][0]["link"]["fd"] = false;
    json["robots"][0]["link"].erase("angle_scale_deg");
    json["robots"][0]["convention"] = convention;
    EXPECT_THAT(mistakes_in(json),
                ElementsAre(testing::StartsWith(
                    "cell.json: robots[0].link.angle_scale_deg: found 0.001, expected 0.01")));
    json["robots"][0]["link"]["angle_scale_deg"] = 0.01;
    EXPECT_THAT(mistakes_in(json), IsEmpty());
    json["robots"][0]["link"]["angle_scale_deg"] = 0.001;
    json["robots"][0]["link"]["fd"] = true;
    EXPECT_THAT(mistakes_in(json), IsEmpty());
  }
}

TEST(RobotLink, NoSecondRobotOnALineOrAController) {
  Json json = with_link({{"type", "modbus-rtu"}, {"device", "/dev/ttyS0"}});
  json["robots"].push_back(json["robots"][0]);
  json["robots"][1]["name"] = "robot2";
  json["robots"][1]["link"] = {{"type", "modbus-client"}, {"device", "/dev/ttyS0"}, {"unit", 2}};
  EXPECT_THAT(
      mistakes_in(json),
      ElementsAre("cell.json: robots[1].link.device: found \"/dev/ttyS0\", as in robots[0].link, expected a "
                  "serial line of its own for each robot"));
  const Json controller = {{"type", "modbus-client"}, {"address", "10.0.0.5"}, {"port", 502}};
  json["robots"][0]["link"] = json["robots"][1]["link"] = controller;
  ASSERT_EQ(mistakes_in(json).size(), 1u);
  EXPECT_THAT(mistakes_in(json)[0], testing::HasSubstr("robots[1].link.address"));
  json["robots"][1]["link"]["unit"] = 2;
  EXPECT_THAT(mistakes_in(json), IsEmpty());
}

// A command on CAN cannot tell where the axis is: the correction would be wrong and valid.
TEST(RobotLink, NoAxisOnACanBus) {
  Json json = with_link({{"type", "can"}, {"interface", "can0"}});
  json["robots"][0]["axis"] = {{"direction", {1, 0, 0}}, {"zero_mm", 0}};
  EXPECT_THAT(mistakes_in(json),
              ElementsAre(testing::StartsWith("cell.json: robots[0].axis: found a linear axis")));
}

TEST(RobotLink, JobsThatACanFrameCannotName) {
  Json json = with_link({{"type", "can"}, {"interface", "can0"}});
  json["jobs"][0]["number"] = 261;
  EXPECT_THAT(mistakes_in(json), ElementsAre(testing::HasSubstr("job numbers up to 255")));
}

TEST(RobotLink, BlocksThatOverlapInTheController) {
  const auto mistakes = mistakes_in(with_link(
      {{"type", "modbus-client"}, {"address", "10.0.0.5"}, {"port", 502}, {"command_address", 135}}));
  ASSERT_EQ(mistakes.size(), 1u);
  EXPECT_THAT(mistakes[0], testing::HasSubstr("command and result block overlap"));
}

}  // namespace
}  // namespace zeropose
