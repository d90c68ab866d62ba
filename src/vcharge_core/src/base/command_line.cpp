#include "vcharge_core/base/command_line.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string_view>

#include <CLI/CLI.hpp>

#include "vcharge_core/base/memory_reuse.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {

CommandLine::Option& CommandLine::Option::required() {
  option_->required();
  return *this;
}

CommandLine::Option& CommandLine::Option::check(
    const std::function<std::string(const std::string& value)>& error) {
  option_->check(error);
  return *this;
}

CommandLine::Option& CommandLine::Option::positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

CommandLine::Option& CommandLine::Option::notNegative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

CommandLine::Option& CommandLine::Option::inRange(int least, int most) {
  option_->check(CLI::Range(least, most));
  return *this;
}

CommandLine::Option& CommandLine::Option::inRange(double least, double most) {
  option_->check(CLI::Range(least, most));
  return *this;
}

CommandLine::Option& CommandLine::Option::oneOf(const std::vector<std::string>& values) {
  option_->check(CLI::IsMember(values));
  return *this;
}

CommandLine::Option& CommandLine::Option::expected(int num_values) {
  option_->expected(num_values);
  return *this;
}

CommandLine::Option& CommandLine::Option::expected(int least_num_values, int most_num_values) {
  option_->expected(least_num_values, most_num_values);
  return *this;
}

CommandLine::Option& CommandLine::Option::delimiter(char letter) {
  option_->delimiter(letter);
  return *this;
}

CommandLine::Option& CommandLine::Option::needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

CommandLine::Option& CommandLine::Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}

CommandLine::Option& CommandLine::Option::showDefault() {
  option_->capture_default_str();
  return *this;
}

bool CommandLine::Option::isGiven() const {
  return option_->count() > 0;
}

CommandLine::CommandLine(const std::string& description) : app_(std::make_unique<CLI::App>(description)) {}

CommandLine::~CommandLine() = default;

template <class T>
CommandLine::Option CommandLine::addOption(const std::string& name, T* value, const std::string& meaning) {
  return Option(app_->add_option(name, *value, meaning));
}

template CommandLine::Option CommandLine::addOption(const std::string&, std::string*, const std::string&);
template CommandLine::Option CommandLine::addOption(const std::string&, int*, const std::string&);
template CommandLine::Option CommandLine::addOption(const std::string&, uint32_t*, const std::string&);
template CommandLine::Option CommandLine::addOption(const std::string&, uint64_t*, const std::string&);
template CommandLine::Option CommandLine::addOption(const std::string&, std::optional<int64_t>*,
                                                    const std::string&);
template CommandLine::Option CommandLine::addOption(const std::string&, double*, const std::string&);
template CommandLine::Option CommandLine::addOption(const std::string&, std::vector<std::string>*,
                                                    const std::string&);
template CommandLine::Option CommandLine::addOption(const std::string&, std::vector<double>*,
                                                    const std::string&);

CommandLine::Option CommandLine::addFlag(const std::string& name, bool* is_given,
                                         const std::string& meaning) {
  return Option(app_->add_flag(name, *is_given, meaning));
}

void CommandLine::setFooter(const std::string& text) {
  app_->footer(text);
}

void CommandLine::parse(const std::vector<std::string>& words) {
  app_->parse(std::vector<std::string>(words.rbegin(), words.rend()));
}

std::string requireNotEmpty(const std::string& value) {
  return value.empty() ? "expected a path, got ''" : "";
}

std::string requireOutput(const std::string& value) {
  const std::string error = requireNotEmpty(value);
  if (error.empty()) {
    requireWritable(value);
  }
  return error;
}

std::string requireOutputFolder(const std::string& value) {
  const std::string error = requireNotEmpty(value);
  if (error.empty()) {
    requireWritableFolder(value);
  }
  return error;
}

void addShowOptions(CommandLine* command_line, bool* show_options) {
  command_line->addFlag("--show-options", show_options,
                        "print all options with their values, units and meaning, and do nothing else");
}

int runTool(CommandLine* command_line, int argc, char** argv, const std::function<void()>& run) {
  keepFreedMemory();
  CLI::App& app = *command_line->app_;
  const std::string tool = std::filesystem::path(argv[0]).filename().string();
  if (std::find(argv, argv + argc, std::string_view("--show-options")) != argv + argc) {
    for (CLI::Option* option : app.get_options()) {
      option->required(false);
    }
  }
  try {
    app.parse(argc, argv);
    run();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error);  // --help
    }
    std::cerr << tool << ": " << error.what() << " (see --help)\n";
    return error.get_exit_code();
  } catch (const std::exception& error) {
    std::cerr << tool << ": " << error.what() << "\n";
    return 1;
  }
  return 0;
}

int runTool(CommandLine* command_line, int argc, char** argv,
            const std::function<void(nlohmann::json* found)>& run) {
  std::string path;
  command_line->addOption("--json", &path, "file for what the tool measured or found (keys below)")
      .check(requireOutput);
  return runTool(command_line, argc, argv, [&] {
    nlohmann::json found = nlohmann::json::object();
    const auto write = [&] {
      if (!path.empty()) {
        writeTextFileAtomically(path, found.dump(1) + "\n");
      }
    };
    try {
      run(&found);
    } catch (const std::exception& error) {
      found["error"] = error.what();
      write();
      throw;
    }
    write();
  });
}

}  // namespace vcharge
