// The socket of the command line against clients that do what they should not.
#include "protocol/line_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <fstream>

namespace zeropose {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class TemporarySocket {
 public:
  TemporarySocket() {
    std::string name = (std::filesystem::temp_directory_path() / "line-socket-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error("cannot make " + name);
    folder_ = name;
  }
  ~TemporarySocket() { std::filesystem::remove_all(folder_); }
  TemporarySocket(const TemporarySocket&) = delete;
  TemporarySocket& operator=(const TemporarySocket&) = delete;
  std::filesystem::path path() const { return folder_ / "run" / "test.sock"; }

 private:
  std::filesystem::path folder_;
};

// A client that sends and reads bytes as the test says.
class RawClient {
 public:
  explicit RawClient(const std::filesystem::path& socket)
      : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
    if (::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("cannot connect");
    const timeval patience{10, 0};
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

  // False: the server has closed.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }

  // Up to and with the next line end; what came until then when the server closes.
  std::string line() {
    std::string text;
    for (char c = 0; c != '\n' && ::recv(fd_.get(), &c, 1, 0) == 1;) text += c;
    return text;
  }

 private:
  Descriptor fd_;
};

class LineSocket : public testing::Test {
 protected:
  std::string answer(const std::string& line) {
    ++answered_;
    return "<" + line + ">";
  }

  TemporarySocket socket_;
  std::atomic<int> answered_ = 0;
  LineServer server_{socket_.path(), [this](const std::string& line) { return answer(line); }};
};

TEST_F(LineSocket, EachLineGetsOneAnswer) {
  EXPECT_EQ(ask(socket_.path(), "hello", 10s), "<hello>");
  EXPECT_EQ(ask(socket_.path(), "", 10s), "<>");
  RawClient client(socket_.path());
  ASSERT_TRUE(client.send("one\ntwo\nthr"));
  EXPECT_EQ(client.line(), "<one>\n");
  EXPECT_EQ(client.line(), "<two>\n");
  ASSERT_TRUE(client.send("ee\n"));
  EXPECT_EQ(client.line(), "<three>\n");
}

TEST_F(LineSocket, HalfALineIsNoQuestion) {
  { EXPECT_TRUE(RawClient(socket_.path()).send("half of a ques")); }
  EXPECT_EQ(ask(socket_.path(), "whole", 10s), "<whole>");
  EXPECT_EQ(answered_, 1);
}

TEST_F(LineSocket, ClientThatIsGoneBeforeItsAnswer) {
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(RawClient(socket_.path()).send("and away\n"));
  EXPECT_EQ(ask(socket_.path(), "still there?", 10s), "<still there?>");
}

// A client that never ends its line is closed, and nothing of it is kept.
TEST_F(LineSocket, LineThatIsTooLongEndsTheConnection) {
  RawClient client(socket_.path());
  const std::string megabyte(1 << 20, 'x');
  int sent = 0;
  while (sent < 64 && client.send(megabyte)) ++sent;
  EXPECT_LT(sent, 64);
  EXPECT_EQ(client.line(), "");
  EXPECT_EQ(ask(socket_.path(), "next", 10s), "<next>");
  EXPECT_EQ(answered_, 1);
}

// One after the other: the second waits while the first is asking, at most the patience with a silent one.
TEST_F(LineSocket, SecondClientGetsItsTurn) {
  RawClient first(socket_.path());
  ASSERT_TRUE(first.send("first\n"));
  EXPECT_EQ(first.line(), "<first>\n");
  EXPECT_EQ(ask(socket_.path(), "second", 15s), "<second>");  // the first says nothing and is closed
  EXPECT_EQ(first.line(), "");
}

TEST_F(LineSocket, OwnerAndGroupOnly) {
  struct stat status {};
  ASSERT_EQ(::stat(socket_.path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0660u);
}

TEST_F(LineSocket, SocketThatIsServedIsNotTaken) {
  try {
    const LineServer another(socket_.path(), [](const std::string&) { return ""; });
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("another process already serves this socket"));
  }
  EXPECT_EQ(ask(socket_.path(), "mine", 10s), "<mine>");
}

// A script waits for the socket's file and asks.
TEST(LineServer, WhoeverFindsItCanAsk) {
  for (int start = 0; start < 200; ++start) {
    const TemporarySocket socket;
    std::string answer;
    std::thread script([&] {
      while (!std::filesystem::exists(socket.path())) continue;
      try {
        answer = ask(socket.path(), "now", 10s);
      } catch (const std::runtime_error& error) {
        answer = error.what();
      }
    });
    const LineServer server(socket.path(), [](const std::string& line) { return line; });
    script.join();
    ASSERT_EQ(answer, "now") << "start " << start;
    for (const auto& entry : std::filesystem::directory_iterator(socket.path().parent_path()))
      EXPECT_EQ(entry.path().filename(), socket.path().filename());
  }
}

TEST(LineServer, TakesOverWhatADeadOneLeft) {
  const TemporarySocket socket;
  std::filesystem::create_directories(socket.path().parent_path());
  {
    const Descriptor dead(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, socket.path().c_str(), sizeof address.sun_path - 1);
    ASSERT_EQ(::bind(dead.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ASSERT_TRUE(std::filesystem::exists(socket.path()));
  const LineServer server(socket.path(), [](const std::string& line) { return line; });
  EXPECT_EQ(ask(socket.path(), "alive", 10s), "alive");
}

TEST(LineServer, FileThatIsNoSocketStays) {
  const TemporarySocket socket;
  std::filesystem::create_directories(socket.path().parent_path());
  std::ofstream(socket.path()) << "somebody's notes";
  EXPECT_THROW(LineServer(socket.path(), [](const std::string&) { return ""; }), std::runtime_error);
  std::string kept;
  std::getline(std::ifstream(socket.path()), kept);
  EXPECT_EQ(kept, "somebody's notes");
}

TEST(LineServer, NobodyThereIsSaid) {
  const TemporarySocket socket;
  try {
    ask(socket.path(), "hello", 1s);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr(socket.path().string() + ": cannot connect"));
  }
}

TEST(LineServer, PathTooLongForASocketIsSaid) {
  EXPECT_THROW(ask("/tmp/" + std::string(120, 'x'), "hello", 1s), std::runtime_error);
}

}  // namespace
}  // namespace zeropose
