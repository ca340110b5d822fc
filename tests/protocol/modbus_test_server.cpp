// The cell of tests/support/answering_cell.h behind a Modbus TCP server. Prints "port N" and serves until its
// standard input ends; fails when a wrong valid result was published.
#include <iostream>
#include <string>

#include "protocol/modbus_server.h"
#include "tests/support/answering_cell.h"

namespace zeropose {
namespace {

int serve() {
  AnsweringCellOptions options;
  options.to_exposure = options.to_answer = std::chrono::milliseconds(200);
  AnsweringCell cell(options);
  {
    ModbusServerOptions any_port;
    any_port.port = 0;
    const ModbusTcpServer server(any_port, {{ModbusTcpRobot{}, cell.endpoint()}});
    std::cout << "port " << server.port() << std::endl;
    for (std::string line; std::getline(std::cin, line);) continue;
  }
  return cell.finish();
}

}  // namespace
}  // namespace zeropose

int main() {
  try {
    return zeropose::serve();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
