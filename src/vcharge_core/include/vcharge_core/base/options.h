#pragma once

#include <exception>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/option_declaration.h"

namespace vcharge {

/// Names of the values of an enum, in order from 0; specialize it for every enum used as an option:
///   template <> inline std::vector<std::string> enumNames<Aggregation>() { return {"mean", "best_k"}; }
template <class Enum>
std::vector<std::string> enumNames();

/// Calls visit(const OptionDeclaration&, field) for every option of a struct, in order.
template <class Options, class Visitor>
void forEachOption(Options& options, Visitor&& visit) {
  Options::OptionsStruct::visitOptions(options, visit);
}

namespace internal {

/// Throws InputError "<source>: <key>: expected <expected>, got '<node>'".
[[noreturn]] void throwBadField(const std::string& source, const std::string& key,
                                const std::string& expected, const YAML::Node& node);
/// Throws InputError unless `node` is absent or a map whose keys are all in `known`.
void checkKeys(const YAML::Node& node, const std::string& source, const std::string& prefix,
               const std::vector<std::string>& known);
void readValue(const YAML::Node& node, const std::string& source, const std::string& key, bool* value);
void readValue(const YAML::Node& node, const std::string& source, const std::string& key, int* value);
void readValue(const YAML::Node& node, const std::string& source, const std::string& key, double* value);
void readValue(const YAML::Node& node, const std::string& source, const std::string& key, std::string* value);
void readValue(const YAML::Node& node, const std::string& source, const std::string& key,
               std::vector<double>* value);
void readValue(const YAML::Node& node, const std::string& source, const std::string& key,
               std::vector<std::string>* value);
int readEnum(const YAML::Node& node, const std::string& source, const std::string& key,
             const std::vector<std::string>& names);

template <class Options, class = void>
struct HasFieldCheck : std::false_type {};
template <class Options>
struct HasFieldCheck<Options, std::void_t<decltype(std::declval<const Options&>().checkFields())>>
    : std::true_type {};

template <class Options, class = void>
struct HasReadHook : std::false_type {};
template <class Options>
struct HasReadHook<Options, std::void_t<decltype(std::declval<Options&>().fieldWasRead(""))>>
    : std::true_type {};

template <class T>
constexpr bool kIsGroup =
    std::is_class_v<T> && !std::is_same_v<T, std::string> && !std::is_same_v<T, std::vector<double>> &&
    !std::is_same_v<T, std::vector<std::string>>;

template <class Options>
void readStruct(const YAML::Node& node, const std::string& source, const std::string& prefix,
                Options* options);

/// The value as YAML, with the fewest digits that read back as the same number.
std::string valueText(double value);
std::string valueText(const std::vector<double>& values);
inline std::string valueText(bool value) {
  return value ? "true" : "false";
}
inline std::string valueText(int value) {
  return std::to_string(value);
}
std::string valueText(const std::string& value);
std::string valueText(const std::vector<std::string>& values);
std::string describeChoices(const std::vector<std::string>& names);
inline const char* typeName(bool /*value*/) {
  return "true or false";
}
inline const char* typeName(int /*value*/) {
  return "integer";
}
inline const char* typeName(double /*value*/) {
  return "number";
}
inline const char* typeName(const std::string& /*value*/) {
  return "text";
}
inline const char* typeName(const std::vector<double>& /*value*/) {
  return "numbers";
}
inline const char* typeName(const std::vector<std::string>& /*value*/) {
  return "texts";
}

/// Throws std::invalid_argument unless the value is in the option's range.
void checkValue(const OptionDeclaration& option, double value);
inline void checkValue(const OptionDeclaration& /*option*/, const std::string& /*value*/) {}
inline void checkValue(const OptionDeclaration& /*option*/, const std::vector<std::string>& /*value*/) {}
void checkValue(const OptionDeclaration& option, const std::vector<double>& values);

template <class Options>
void readStruct(const YAML::Node& node, const std::string& source, const std::string& prefix,
                Options* options) {
  std::vector<std::string> names;
  forEachOption(*options,
                [&](const OptionDeclaration& option, auto& /*field*/) { names.emplace_back(option.name); });
  checkKeys(node, source, prefix, names);
  if (!node.IsMap()) {
    return;
  }
  forEachOption(*options, [&](const OptionDeclaration& option, auto& field) {
    using T = std::decay_t<decltype(field)>;
    const YAML::Node child = node[option.name];
    if (!child.IsDefined()) {
      return;
    }
    const std::string key = prefix.empty() ? option.name : prefix + "." + option.name;
    if constexpr (std::is_enum_v<T>) {
      field = static_cast<T>(readEnum(child, source, key, enumNames<T>()));
    } else if constexpr (kIsGroup<T>) {
      readStruct(child, source, key, &field);
    } else {
      readValue(child, source, key, &field);
    }
    if constexpr (HasReadHook<Options>::value) {
      options->fieldWasRead(option.name);
    }
  });
}

/// One row of the table that --show-options and the option reference print.
struct OptionRow {
  std::string key;  ///< including the groups around it, for example "tracker.max_features"
  std::string type;
  std::string value;    ///< value as YAML
  std::string allowed;  ///< the allowed values in words; empty if any value is allowed
  std::string meaning;
  std::string group_type;  ///< type of a group of options; empty for an option
};
template <class Options>
void collectRows(const Options& options, const std::string& prefix, std::vector<OptionRow>* rows);

template <class T>
OptionRow makeRow(const OptionDeclaration& option, const std::string& prefix, const T& field) {
  OptionRow row;
  row.key = prefix + option.name;
  row.meaning = option.meaning;
  if constexpr (std::is_enum_v<T>) {
    row.type = "choice";
    row.value = enumNames<T>().at(static_cast<size_t>(field));
    row.allowed = describeChoices(enumNames<T>());
  } else if constexpr (kIsGroup<T>) {
    row.group_type = typeid(T).name();
  } else {
    row.type = typeName(field);
    row.value = valueText(field);
    row.allowed = option.range.requirement();
  }
  return row;
}

template <class Options>
void collectRows(const Options& options, const std::string& prefix, std::vector<OptionRow>* rows) {
  forEachOption(options, [&](const OptionDeclaration& option, const auto& field) {
    rows->push_back(makeRow(option, prefix, field));
    if constexpr (kIsGroup<std::decay_t<decltype(field)>>) {
      collectRows(field, prefix + option.name + ".", rows);
    }
  });
}

std::string showRows(const std::vector<OptionRow>& rows);
std::string listRows(const std::vector<OptionRow>& rows, std::map<std::string, std::string>* listed_groups,
                     const std::string& section);

}  // namespace internal

/// Overrides options by the keys of a YAML map; options without a key keep their value. Serves YAML files
/// and, through vcharge_ros, the parameter server. `source` names the file or namespace in errors. Throws
/// InputError for unknown keys, wrong types and values that validate() rejects; `options` is then unchanged.
template <class Options>
void readFields(const YAML::Node& node, const std::string& source, Options* options) {
  Options read = *options;
  internal::readStruct(node, source, "", &read);
  try {
    read.validate();
  } catch (const std::invalid_argument& error) {
    throw InputError(source + ": " + error.what());
  }
  *options = read;
}

/// Reads options from a file. Throws InputError when the file cannot be read or is not YAML.
YAML::Node loadYamlFile(const std::string& path);
template <class Options>
void readFieldsFromFile(const std::string& path, Options* options) {
  readFields(loadYamlFile(path), path, options);
}

/// All options with their values as a YAML map, for provenance.
template <class Options>
YAML::Node writeFields(const Options& options) {
  YAML::Node node(YAML::NodeType::Map);
  forEachOption(options, [&](const OptionDeclaration& option, const auto& field) {
    using T = std::decay_t<decltype(field)>;
    if constexpr (std::is_enum_v<T>) {
      node[option.name] = enumNames<T>().at(static_cast<size_t>(field));
    } else if constexpr (internal::kIsGroup<T>) {
      node[option.name] = writeFields(field);
    } else {
      node[option.name] = field;
    }
  });
  return node;
}

/// The same as YAML text, with the meaning and allowed values of each option as comments, for --show-options.
template <class Options>
std::string showOptions(const Options& options) {
  std::vector<internal::OptionRow> rows;
  internal::collectRows(options, "", &rows);
  return internal::showRows(rows);
}

/// A Markdown table of all options of a section with default, allowed values and meaning. `listed_groups`
/// has the place of every type of group listed so far: such a group is a reference to it. The others are
/// added.
template <class Options>
std::string optionTable(const Options& options, const std::string& section,
                        std::map<std::string, std::string>* listed_groups) {
  std::vector<internal::OptionRow> rows;
  internal::collectRows(options, "", &rows);
  return internal::listRows(rows, listed_groups, section);
}

/// Throws std::invalid_argument "<field>: <requirement>, is <value>" unless the condition holds. For
/// checkFields().
void requireField(bool condition, const char* field, const char* requirement, double value);

/// Validates a nested options struct; errors name "<field>.<inner field>".
template <class Options>
void validateInner(const char* field, const Options& options) {
  try {
    options.validate();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(field) + "." + error.what());
  }
}

/// The body of validate(): checks every range and every group, then calls checkFields().
template <class Options>
void validateOptions(const Options& options) {
  forEachOption(options, [](const OptionDeclaration& option, const auto& field) {
    using T = std::decay_t<decltype(field)>;
    if constexpr (internal::kIsGroup<T>) {
      validateInner(option.name, field);
    } else if constexpr (!std::is_enum_v<T>) {
      internal::checkValue(option, field);
    }
  });
  if constexpr (internal::HasFieldCheck<Options>::value) {
    options.checkFields();
  }
}

}  // namespace vcharge
