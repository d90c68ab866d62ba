#pragma once

#include <algorithm>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <string>
#include <string_view>
#include <type_traits>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "vcharge_core/files/file_io.h"

namespace vcharge {

/// Check of a CLI::Option for a path: returns an error for an empty path, or "".
inline std::string requireNotEmpty(const std::string& value) {
  return value.empty() ? "expected a path, got ''" : "";
}

/// Check of a CLI::Option for a file to write: reports before the work starts if it cannot be written.
/// Throws InputError naming the path.
inline std::string requireOutput(const std::string& value) {
  const std::string error = requireNotEmpty(value);
  if (error.empty()) {
    requireWritable(value);
  }
  return error;
}
/// The same for a folder to write.
inline std::string requireOutputFolder(const std::string& value) {
  const std::string error = requireNotEmpty(value);
  if (error.empty()) {
    requireWritableFolder(value);
  }
  return error;
}

/// Adds --show-options to a tool. With it, runTool() requires no other argument.
inline void addShowOptions(CLI::App* app, bool* show_options) {
  app->add_flag("--show-options", *show_options,
                "print all options with their values, units and meaning, and do nothing else");
}

namespace internal {

/// Parses the arguments, runs, and turns an error into one line and an exit status.
inline int parseAndRun(CLI::App* app, int argc, char** argv, const std::function<void()>& run) {
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

inline void writeJson(const nlohmann::json& found, const std::string& path) {
  if (!path.empty()) {
    writeTextFileAtomically(path, found.dump(1) + "\n");
  }
}

}  // namespace internal

/// A tool's main(): parses its arguments, then calls `run`. Returns the exit status, which is 0 only for
/// success. With --show-options, a tool that has it requires no other argument. An error in the arguments or
/// thrown by `run` is printed as one line "<tool>: <what>" on standard error.
///
/// If `run` takes a `nlohmann::json*`, the tool also has the option `--json FILE`: the content of this object
/// is written there when `run` returns or throws, then with the error's text as "error". The tool
/// documents the keys in `app->footer("Keys of --json: ...")`. NaN is written as null.
template <class Run>
int runTool(CLI::App* app, int argc, char** argv, const Run& run) {
  if constexpr (std::is_invocable_v<const Run&, nlohmann::json*>) {
    std::string path;
    app->add_option("--json", path, "file for what the tool measured or found (keys below)")
        ->check(requireOutput);
    return internal::parseAndRun(app, argc, argv, [&] {
      nlohmann::json found = nlohmann::json::object();
      try {
        run(&found);
      } catch (const std::exception& error) {
        found["error"] = error.what();
        internal::writeJson(found, path);
        throw;
      }
      internal::writeJson(found, path);
    });
  } else {
    return internal::parseAndRun(app, argc, argv, run);
  }
}

}  // namespace vcharge
