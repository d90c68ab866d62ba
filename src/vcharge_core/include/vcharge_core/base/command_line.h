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

/// For CLI::Option::check(): rejects an empty path.
inline std::string requireNotEmpty(const std::string& value) {
  return value.empty() ? "expected a path, got ''" : "";
}

/// The main() of a tool: parses the arguments, then calls `run`. Returns the exit status, 0 only for success.
/// With --show-options, no other argument is required. Errors in the arguments and exceptions from `run` are
/// printed as one line "<tool>: <reason>" on standard error.
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
