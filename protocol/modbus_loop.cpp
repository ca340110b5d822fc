#include "protocol/modbus_loop.h"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace zeropose {
namespace {

using std::chrono::milliseconds;
using Counter = std::uint64_t ModbusCounters::*;

constexpr std::uint64_t listener_event = 0, wake_event = 1;
constexpr milliseconds longest_wait{500}, accept_pause{100};
constexpr int accepts_per_round = 16;

ModbusServerOptions checked(ModbusServerOptions options, const std::vector<ModbusTcpServer::Served>& robots) {
  std::set<std::string> listed;
  UnitSet units;
  for (const auto& [robot, endpoint] : robots) {
    listed.insert(robot.allowed_writers.begin(), robot.allowed_writers.end());
    const std::uint8_t unit = robot.unit.unit;
    if (units[unit]) throw std::invalid_argument("Modbus: unit " + std::to_string(unit) + " is there twice");
    units.set(unit);
  }
  if (robots.empty()) throw std::invalid_argument("Modbus: a server needs at least one robot");
  if (options.max_clients == 0 || options.max_clients < listed.size())
    throw std::invalid_argument("Modbus: max_clients must be at least 1 and hold every listed writer, " +
                                std::to_string(listed.size()) + " here");
  if (options.frame_time <= milliseconds(0))
    throw std::invalid_argument("Modbus: frame_time must be positive");
  return options;
}

Counter counter_of(FrameProblem problem) {
  switch (problem) {
    case FrameProblem::wrong_protocol:
      return &ModbusCounters::wrong_protocol;
    case FrameProblem::wrong_length:
      return &ModbusCounters::wrong_length;
    case FrameProblem::wrong_unit:
      return &ModbusCounters::wrong_unit;
    case FrameProblem::wrong_pdu:
      break;
  }
  return &ModbusCounters::wrong_pdu;
}

}  // namespace

ModbusTcpServer::Loop::Loop(const ModbusServerOptions& options, const std::vector<Served>& robots)
    : options_(checked(options, robots)),
      listener_(listen_on(options.address, options.port)),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      port_(port_of(listener_.get())) {
  for (const auto& [robot, endpoint] : robots) {
    AllowList allowed(robot.allowed_writers, robot.allowed_readers);
    for (const in_addr_t writer : allowed.writers()) listed_.insert(writer);
    robots_.push_back({robot.unit.unit, endpoint, std::move(allowed), {robot.unit, endpoint}});
  }
  if (!watch(listener_.get(), listener_event, EPOLLIN, EPOLL_CTL_ADD) ||
      !watch(wake_.get(), wake_event, EPOLLIN, EPOLL_CTL_ADD))
    throw std::runtime_error(std::string("Modbus: epoll: ") + std::strerror(errno));
  for (const Robot& robot : robots_) robot.endpoint.on_change([this] { wake(); });
  thread_ = std::thread([this] { run(); });
}

ModbusTcpServer::Loop::~Loop() {
  for (const Robot& robot : robots_) robot.endpoint.on_change({});
  stopping_ = true;
  wake();
  thread_.join();
}

void ModbusTcpServer::Loop::count(Counter counter) {
  const std::scoped_lock lock(mutex_);
  ++(counters_.*counter);
}

ModbusCounters ModbusTcpServer::Loop::counters() {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

bool ModbusTcpServer::Loop::watch(int fd, std::uint64_t id, std::uint32_t events, int operation) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = id;
  return epoll_ctl(epoll_.get(), operation, fd, &event) == 0;
}

void ModbusTcpServer::Loop::wake() {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the loop is awake already.
  [[maybe_unused]] const auto written = write(wake_.get(), &one, sizeof one);
}

void ModbusTcpServer::Loop::run() {
  while (!stopping_) wait_and_serve();
}

milliseconds ModbusTcpServer::Loop::time_to_wait(TimePoint now) const {
  TimePoint until = now + longest_wait;
  if (accept_again_at_) until = std::min(until, *accept_again_at_);
  for (const auto& [id, client] : clients_)
    if (client.waiting_since) until = std::min(until, *client.waiting_since + options_.frame_time);
  for (const Robot& robot : robots_)
    if (const auto next = robot.endpoint.next_event()) until = std::min(until, *next);
  return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(until - now));
}

void ModbusTcpServer::Loop::wait_and_serve() {
  std::array<epoll_event, 64> events{};
  const auto wait = static_cast<int>(time_to_wait(Clock::now()).count());
  const int ready = epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), wait);
  const TimePoint now = Clock::now();
  for (int i = 0; i < ready; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    if (event.data.u64 == listener_event) {
      accept_clients(now);
    } else if (event.data.u64 == wake_event) {
      std::uint64_t value = 0;
      [[maybe_unused]] const auto size = read(wake_.get(), &value, sizeof value);
    } else {
      serve(event.data.u64, event.events);
    }
  }
  close_slow_clients(Clock::now());
  if (accept_again_at_ && now >= *accept_again_at_) {
    accept_again_at_.reset();
    watch(listener_.get(), listener_event, EPOLLIN, EPOLL_CTL_MOD);
  }
  for (const Robot& robot : robots_) robot.endpoint.tick();
  const std::scoped_lock lock(mutex_);
  ++counters_.rounds;
  counters_.clients = clients_.size();
}

void ModbusTcpServer::Loop::accept_clients(TimePoint now) {
  for (int i = 0; i < accepts_per_round; ++i) {
    auto accepted = accept_from(listener_.get());
    if (accepted) {
      take_in(std::move(*accepted), now);
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      return;
    } else if (errno != EINTR && errno != ECONNABORTED) {
      // Out of descriptors or memory: the ones that are connected go on, new ones wait a moment.
      watch(listener_.get(), listener_event, 0, EPOLL_CTL_MOD);
      accept_again_at_ = now + accept_pause;
      return;
    }
  }
}

void ModbusTcpServer::Loop::take_in(Accepted accepted, TimePoint now) {
  UnitSet reachable, writable;
  for (const Robot& robot : robots_) {
    const auto role = robot.allowed.role_of(accepted.peer);
    reachable[robot.unit] = role != AllowList::Role::none;
    writable[robot.unit] = role == AllowList::Role::writer;
  }
  if (reachable.none()) return count(&ModbusCounters::refused_address);
  Client client{std::move(accepted.socket),
                accepted.peer,
                listed_.contains(accepted.peer),
                writable,
                FrameReader(reachable),
                now,
                {},
                false,
                {}};
  const std::size_t places = options_.max_clients - places_reserved_for_others(client);
  if (clients_.size() >= places && !make_room_for(client, now)) return count(&ModbusCounters::refused_full);
  const ConnectionId id = RobotEndpoint::new_connection();
  if (!watch(client.socket.get(), id, EPOLLIN | EPOLLRDHUP, EPOLL_CTL_ADD))
    return count(&ModbusCounters::refused_full);
  count(&ModbusCounters::connections);
  clients_.emplace(id, std::move(client));
}

// Listed writers that are not connected, without the one that comes.
std::size_t ModbusTcpServer::Loop::places_reserved_for_others(const Client& client) const {
  std::set<in_addr_t> absent = listed_;
  absent.erase(client.peer);
  for (const auto& [id, other] : clients_) absent.erase(other.peer);
  return absent.size();
}

// The client that has been without a request for the longest time goes; never the owner of a result, and a
// listed writer only for a newer connection of its own.
bool ModbusTcpServer::Loop::make_room_for(const Client& client, TimePoint now) {
  std::optional<ConnectionId> idle;
  TimePoint oldest = now - options_.frame_time;
  for (const auto& [id, other] : clients_) {
    const bool owns = std::ranges::any_of(
        robots_, [own = id](const Robot& robot) { return robot.endpoint.owner() == own; });
    if (owns || (other.listed && other.peer != client.peer) || other.last_request >= oldest) continue;
    oldest = other.last_request;
    idle = id;
  }
  if (idle) close_client(*idle, &ModbusCounters::evicted);
  return idle.has_value();
}

void ModbusTcpServer::Loop::close_client(ConnectionId id, Counter why) {
  count(why);
  clients_.erase(id);
  for (const Robot& robot : robots_) robot.endpoint.disconnected(id);
}

void ModbusTcpServer::Loop::close_slow_clients(TimePoint now) {
  std::vector<ConnectionId> slow;
  for (const auto& [id, client] : clients_)
    if (client.waiting_since && now >= *client.waiting_since + options_.frame_time) slow.push_back(id);
  for (const ConnectionId id : slow) close_client(id, &ModbusCounters::closed_slow);
}

void ModbusTcpServer::Loop::serve(ConnectionId id, std::uint32_t events) {
  const auto it = clients_.find(id);
  if (it == clients_.end()) return;  // closed earlier in this round
  Client& client = it->second;
  if (events & EPOLLERR) return close_client(id, &ModbusCounters::closed_by_peer);
  if ((events & EPOLLOUT) && !send_unsent(id, client)) return;
  if (events & (EPOLLIN | EPOLLRDHUP | EPOLLHUP)) read_from(id, client);
}

void ModbusTcpServer::Loop::read_from(ConnectionId id, Client& client) {
  std::array<std::uint8_t, 512> bytes{};
  const ssize_t size = recv(client.socket.get(), bytes.data(), bytes.size(), 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (size <= 0) return close_client(id, &ModbusCounters::closed_by_peer);
  client.reader.feed(std::span(bytes).first(static_cast<std::size_t>(size)));
  if (!handle_frames(id, client)) return;
  if (!client.unsent.empty()) send_unsent(id, client);
}

// False: the client is gone.
bool ModbusTcpServer::Loop::handle_frames(ConnectionId id, Client& client) {
  bool any = false;
  while (const auto request = client.reader.next()) {
    any = true;
    const auto reply = answer(*request, id, client);
    if (reply.empty()) {
      close_client(id, &ModbusCounters::wrong_pdu);
      return false;
    }
    client.unsent.insert(client.unsent.end(), reply.begin(), reply.end());
  }
  if (const auto problem = client.reader.problem()) {
    // The requests before it were good ones.
    if (!client.unsent.empty() && !send_unsent(id, client)) return false;
    close_client(id, counter_of(*problem));
    return false;
  }
  const TimePoint now = Clock::now();
  if (any) client.last_request = now;
  if (!client.reader.has_partial_frame())
    client.waiting_since.reset();
  else if (any || !client.waiting_since)
    client.waiting_since = now;
  return true;
}

// What the peer does not take now is tried again when it can; until then it is not read from.
bool ModbusTcpServer::Loop::send_unsent(ConnectionId id, Client& client) {
  const ssize_t sent = send(client.socket.get(), client.unsent.data(), client.unsent.size(), MSG_NOSIGNAL);
  if (sent < 0 && errno != EAGAIN && errno != EINTR) {
    close_client(id, &ModbusCounters::closed_by_peer);
    return false;
  }
  if (sent > 0) client.unsent.erase(client.unsent.begin(), client.unsent.begin() + sent);
  const bool done = client.unsent.empty();
  if (!done && !client.waiting_since) client.waiting_since = Clock::now();
  if (done && !client.reader.has_partial_frame()) client.waiting_since.reset();
  if (done == client.blocked) {
    client.blocked = !done;
    watch(client.socket.get(), id, done ? EPOLLIN | EPOLLRDHUP : EPOLLOUT, EPOLL_CTL_MOD);
  }
  return true;
}

std::vector<std::uint8_t> ModbusTcpServer::Loop::answer(const Adu& request, ConnectionId id,
                                                        const Client& client) {
  const auto robot = std::ranges::find(robots_, request.unit(), &Robot::unit);
  const std::scoped_lock lock(mutex_);
  return robot->server.answer(request, id, client.writable[request.unit()], reply_, counters_);
}

}  // namespace zeropose
