// The cell of tests/support/answering_cell.h on one of the other Modbus wires. Prints "ready", then serves
// until its standard input ends; fails when a wrong valid result was published.
//   modbus_test_wire client PORT [MAX_REGISTERS]   a controller on the loopback is the server
//   modbus_test_wire rtu DEVICE UNIT               on a serial line, 19200 baud, no parity
#include <iostream>
#include <thread>
#include <vector>

#include "protocol/modbus_client_link.h"
#include "protocol/modbus_rtu_server.h"
#include "tests/support/answering_cell.h"

namespace zeropose {
namespace {

using std::chrono::milliseconds;

bool is_up(const ModbusRtuServer& server) { return server.counters().open; }
bool is_up(const ModbusClientLink&) { return true; }  // its controller may come later

template <class Wire, class Options>
int serve(const Options& options) {
  AnsweringCellOptions cell_options;
  cell_options.validity = milliseconds(3000);
  cell_options.measure_deadline = milliseconds(1000);
  AnsweringCell cell(cell_options);
  {
    const Wire wire(options, cell.endpoint());
    while (!is_up(wire)) std::this_thread::sleep_for(milliseconds(1));
    std::cout << "ready" << std::endl;
    for (std::string line; std::getline(std::cin, line);) continue;
  }
  return cell.finish();
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() >= 2 && arguments[0] == "client") {
    ModbusClientOptions options;
    options.where = ModbusTcpAddress{"127.0.0.1", static_cast<std::uint16_t>(std::stoi(arguments[1]))};
    options.first_pause = milliseconds(20);
    options.longest_pause = milliseconds(100);
    if (arguments.size() > 2) options.max_registers = std::stoul(arguments[2]);
    return serve<ModbusClientLink>(options);
  }
  if (arguments.size() == 3 && arguments[0] == "rtu") {
    ModbusRtuOptions options;
    options.line = {arguments[1], 19200, 'N', 1};
    options.unit.unit = static_cast<std::uint8_t>(std::stoi(arguments[2]));
    options.first_pause = milliseconds(20);
    options.longest_pause = milliseconds(100);
    return serve<ModbusRtuServer>(options);
  }
  std::cerr << "usage: modbus_test_wire client PORT [MAX_REGISTERS] | rtu DEVICE UNIT\n";
  return 2;
}

}  // namespace
}  // namespace zeropose

int main(int argc, char** argv) {
  try {
    return zeropose::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
