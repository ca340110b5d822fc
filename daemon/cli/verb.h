// Verbs and options of the command line. Behind them is CLI11, whose header is compiled in verb.cpp alone: it
// takes most of the time that a file of this folder would need.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace zeropose::cli {

// What an option may be. Handles like this one are copied freely; what is behind them lives as long as
// the command line.
class VerbOption {
 public:
  explicit VerbOption(CLI::Option& option) : option_(&option) {}
  VerbOption required() const;
  VerbOption range(int lowest, int highest) const;
  VerbOption range(double lowest, double highest) const;
  VerbOption one_of(const std::vector<std::string>& words) const;
  VerbOption delimiter(char between) const;     // of several values in one word
  VerbOption expected(int values) const;        // so many of them
  VerbOption once_per_value() const;            // several values: the option anew before each
  VerbOption excludes(VerbOption other) const;  // not with that one
  VerbOption needs(VerbOption other) const;     // only with that one
  VerbOption shows_default() const;             // in --help

 private:
  CLI::Option* option_;
};

class Verb {
 public:
  explicit Verb(CLI::App& app) : app_(&app) {}
  Verb add_subcommand(const std::string& name, const std::string& help) const;
  // Names as of CLI11: "--pose", "-n,--number", "file" for a positional one. Defined in verb.cpp for the
  // types there.
  template <typename Value>
  VerbOption add_option(const std::string& names, Value& value, const std::string& help) const;
  VerbOption add_flag(const std::string& names, bool& value, const std::string& help) const;
  void require_subcommand() const;
  void footer(const std::string& text) const;  // of --help, below the options
  void callback(std::function<void()> run) const;

 private:
  CLI::App* app_;
};

// Adds the verbs, reads the arguments and runs the verb that they name; returns the exit status, 2 for wrong
// usage.
int run_command_line(const std::string& description, const std::string& version,
                     const std::function<void(Verb, int& exit_status)>& add_verbs, int argc, char** argv);

}  // namespace zeropose::cli
