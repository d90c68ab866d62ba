#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace vcharge {

/// The options of a tool, with --help. (It hides the library that parses them, whose headers take long to
/// compile.)
class CommandLine {
 public:
  /// An option that was added; valid as long as its command line.
  class Option {
   public:
    Option& required();
    /// `error` returns what is wrong with a value, or "".
    Option& check(const std::function<std::string(const std::string& value)>& error);
    Option& positive();
    Option& notNegative();
    Option& inRange(int least, int most);
    Option& inRange(double least, double most);
    Option& oneOf(const std::vector<std::string>& values);
    Option& expected(int num_values);
    Option& expected(int least_num_values, int most_num_values);
    Option& delimiter(char letter);
    Option& needs(const Option& other);
    Option& excludes(const Option& other);
    /// Shows the present value in --help.
    Option& showDefault();
    /// Whether it was given, after parse().
    bool isGiven() const;

   private:
    friend class CommandLine;
    explicit Option(CLI::Option* option) : option_(option) {}

    CLI::Option* option_;
  };

  explicit CommandLine(const std::string& description = "");
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;
  ~CommandLine();

  /// `name` as "--name", or without dashes for a value by its place. `value` gets what is given: a
  /// std::string, int, uint32_t, uint64_t, double, std::optional<int64_t>, or a std::vector of strings or
  /// doubles.
  template <class T>
  Option addOption(const std::string& name, T* value, const std::string& meaning = "");
  Option addFlag(const std::string& name, bool* is_given, const std::string& meaning);
  /// Text after the options of --help.
  void setFooter(const std::string& text);

  /// Throws std::exception naming the option and what was expected.
  void parse(const std::vector<std::string>& words);

 private:
  friend int runTool(CommandLine* command_line, int argc, char** argv, const std::function<void()>& run);

  std::unique_ptr<CLI::App> app_;
};

/// Check of an option for a path: returns an error for an empty path, or "".
std::string requireNotEmpty(const std::string& value);
/// Check of an option for a file to write: reports before the work starts if it cannot be written.
/// Throws InputError naming the path.
std::string requireOutput(const std::string& value);
/// The same for a folder to write.
std::string requireOutputFolder(const std::string& value);

/// Adds --show-options to a tool. With it, runTool() requires no other argument.
void addShowOptions(CommandLine* command_line, bool* show_options);

/// A tool's main(): parses its arguments, then calls `run`. Returns the exit status, which is 0 only for
/// success. With --show-options, a tool that has it requires no other argument. An error in the arguments or
/// thrown by `run` is printed as one line "<tool>: <what>" on standard error.
int runTool(CommandLine* command_line, int argc, char** argv, const std::function<void()>& run);

/// The same for a tool with the option `--json FILE`: the object that `run` fills is written there when `run`
/// returns or throws, then with the error's text as "error". The tool documents the keys in
/// `setFooter("Keys of --json: ...")`. NaN is written as null.
int runTool(CommandLine* command_line, int argc, char** argv,
            const std::function<void(nlohmann::json* found)>& run);

}  // namespace vcharge
