#include "daemon/cli/verb.h"

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

namespace zeropose::cli {

VerbOption VerbOption::required() const {
  option_->required();
  return *this;
}

VerbOption VerbOption::range(int lowest, int highest) const {
  option_->check(CLI::Range(lowest, highest));
  return *this;
}

VerbOption VerbOption::range(double lowest, double highest) const {
  option_->check(CLI::Range(lowest, highest));
  return *this;
}

VerbOption VerbOption::one_of(const std::vector<std::string>& words) const {
  option_->check(CLI::IsMember(words));
  return *this;
}

VerbOption VerbOption::delimiter(char between) const {
  option_->delimiter(between);
  return *this;
}

VerbOption VerbOption::expected(int values) const {
  option_->expected(values);
  return *this;
}

VerbOption VerbOption::once_per_value() const {
  option_->allow_extra_args(false);
  return *this;
}

VerbOption VerbOption::excludes(VerbOption other) const {
  option_->excludes(other.option_);
  return *this;
}

VerbOption VerbOption::needs(VerbOption other) const {
  option_->needs(other.option_);
  return *this;
}

VerbOption VerbOption::shows_default() const {
  option_->capture_default_str();
  return *this;
}

Verb Verb::add_subcommand(const std::string& name, const std::string& help) const {
  return Verb(*app_->add_subcommand(name, help));
}

template <typename Value>
VerbOption Verb::add_option(const std::string& names, Value& value, const std::string& help) const {
  return VerbOption(*app_->add_option(names, value, help));
}

VerbOption Verb::add_flag(const std::string& names, bool& value, const std::string& help) const {
  return VerbOption(*app_->add_flag(names, value, help));
}

void Verb::require_subcommand() const { app_->require_subcommand(1); }

void Verb::footer(const std::string& text) const { app_->footer(text); }

void Verb::callback(std::function<void()> run) const { app_->callback(std::move(run)); }

int run_command_line(const std::string& description, const std::string& version,
                     const std::function<void(Verb, int& exit_status)>& add_verbs, int argc, char** argv) {
  CLI::App app(description);
  app.set_version_flag("--version", version);
  app.require_subcommand(1);
  int exit_status = 0;
  add_verbs(Verb(app), exit_status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return exit_status;
}

#define ZEROPOSE_OPTION_OF(...) \
  template VerbOption Verb::add_option(const std::string&, __VA_ARGS__&, const std::string&) const
ZEROPOSE_OPTION_OF(int);
ZEROPOSE_OPTION_OF(std::size_t);
ZEROPOSE_OPTION_OF(std::uint16_t);
ZEROPOSE_OPTION_OF(double);
ZEROPOSE_OPTION_OF(std::string);
ZEROPOSE_OPTION_OF(std::filesystem::path);
ZEROPOSE_OPTION_OF(std::optional<double>);
ZEROPOSE_OPTION_OF(std::optional<std::string>);
ZEROPOSE_OPTION_OF(std::vector<int>);
ZEROPOSE_OPTION_OF(std::vector<double>);
ZEROPOSE_OPTION_OF(std::vector<std::string>);
#undef ZEROPOSE_OPTION_OF

}  // namespace zeropose::cli
