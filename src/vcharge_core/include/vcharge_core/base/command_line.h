#pragma once

#include <algorithm>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace vcharge {

/// For CLI::Option::check(): an empty path is no path.
inline std::string requireNotEmpty(const std::string& value) {
  return value.empty() ? "expected a path, got ''" : "";
}

/// A tool's main(): parses its arguments, then calls `run`. Returns the exit status, which is 0 only for
/// success. Asked for --show-options, a tool that has it requires nothing else. An error, of the arguments or
/// thrown by `run`, is one line "<tool>: <what>" on standard error.
inline int runTool(CLI::App* app, int argc, char** argv, const std::function<void()>& run) {
  const std::string tool = std::filesystem::path(argv[0]).filename().string();
  if (std::find(argv, argv + argc, std::string_view("--show-options")) != argv + argc) {
    for (CLI::Option* option : app->get_options()) {
      option->required(false);
    }
  }
  try {
    app->parse(argc, argv);
    run();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app->exit(error);  // --help
    }
    std::cerr << tool << ": " << error.what() << " (see --help)\n";
    return error.get_exit_code();
  } catch (const std::exception& error) {
    std::cerr << tool << ": " << error.what() << "\n";
    return 1;
  }
  return 0;
}

}  // namespace vcharge
