// The cell of tests/support/answering_cell.h on a CAN bus: can_test_server INTERFACE [fd]. Prints "ready" and
// serves until its standard input ends; answers each line there with its counters. Fails when a wrong valid
// result was published.
#include <iostream>
#include <string>

#include "protocol/can_link.h"
#include "tests/support/answering_cell.h"

namespace zeropose {
namespace {

constexpr int node_number = 5;

void print(const CanLink& link, const RobotEndpoint& endpoint) {
  const CanCounters c = link.counters();
  std::cout << "commands " << c.commands << " refused " << c.refused << " wrong_size " << c.wrong_size
            << " remote " << c.remote << " extended " << c.extended << " foreign " << c.foreign << " bus_off "
            << c.bus_off << " unconfirmed " << c.unconfirmed << " opened " << c.opened << " links_lost "
            << c.links_lost << " results_confirmed " << c.results_confirmed << " fault "
            << static_cast<int>(link.fault()) << " accepted " << endpoint.counters().accepted << std::endl;
}

int serve(const std::string& interface, bool fd) {
  AnsweringCellOptions options;
  options.to_answer = std::chrono::milliseconds(0);
  options.validity = std::chrono::milliseconds(20000);
  AnsweringCell cell(options);
  {
    CanOptions can;
    can.interface = interface;
    can.node = node_number;
    can.fd = fd;
    const CanLink link(can, cell.endpoint());
    std::cout << "ready" << std::endl;
    for (std::string line; std::getline(std::cin, line);) print(link, cell.endpoint());
  }
  return cell.finish();
}

}  // namespace
}  // namespace zeropose

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: can_test_server INTERFACE [fd]\n";
    return 2;
  }
  try {
    return zeropose::serve(arguments[1], count > 2 && std::string(arguments[2]) == "fd");
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
