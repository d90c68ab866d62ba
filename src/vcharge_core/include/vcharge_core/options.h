#pragma once

#include <exception>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "vcharge_core/error.h"

namespace vcharge {

/// Name of each value of an option's enum, in order from 0; specialize for every enum used as a field:
///   template <> inline std::vector<std::string> enumNames<Aggregation>() { return {"mean", "best_k"}; }
template <class Enum>
std::vector<std::string> enumNames();

/// An options struct has `template <class V> void visitFields(V&& visit)`, which calls visit("name", field)
/// for each field (a number, string, list, enum or another options struct), and `void validate() const`.

namespace internal {

/// InputError: "<source>: <key>: expected <expected>, got '<node>'".
[[noreturn]] void throwBadField(const std::string& source, const std::string& key,
                                const std::string& expected, const YAML::Node& node);
/// InputError unless `node` is a map (or absent) all of whose keys are in `known`.
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

struct NameCollector {
  std::vector<std::string> names;
  template <class T>
  void operator()(const char* name, T&) {
    names.emplace_back(name);
  }
};

template <class Options>
void readStruct(const YAML::Node& node, const std::string& source, const std::string& prefix,
                Options* options);

struct FieldReader {
  const YAML::Node& node;
  const std::string& source;
  const std::string& prefix;
  template <class T>
  void operator()(const char* name, T& field) {
    const YAML::Node child = node.IsMap() ? node[name] : YAML::Node(YAML::NodeType::Undefined);
    if (!child.IsDefined()) {
      return;
    }
    const std::string key = prefix.empty() ? name : prefix + "." + name;
    if constexpr (std::is_enum_v<T>) {
      field = static_cast<T>(readEnum(child, source, key, enumNames<T>()));
    } else if constexpr (std::is_class_v<T> && !std::is_same_v<T, std::string> &&
                         !std::is_same_v<T, std::vector<double>> &&
                         !std::is_same_v<T, std::vector<std::string>>) {
      readStruct(child, source, key, &field);
    } else {
      readValue(child, source, key, &field);
    }
  }
};

template <class Options>
void readStruct(const YAML::Node& node, const std::string& source, const std::string& prefix,
                Options* options) {
  NameCollector collector;
  options->visitFields(collector);
  checkKeys(node, source, prefix, collector.names);
  FieldReader reader{node, source, prefix};
  options->visitFields(reader);
}

struct FieldWriter {
  YAML::Node& node;
  template <class T>
  void operator()(const char* name, T& field) {
    if constexpr (std::is_enum_v<T>) {
      node[name] = enumNames<T>().at(static_cast<size_t>(field));
    } else if constexpr (std::is_class_v<T> && !std::is_same_v<T, std::string> &&
                         !std::is_same_v<T, std::vector<double>> &&
                         !std::is_same_v<T, std::vector<std::string>>) {
      YAML::Node child(YAML::NodeType::Map);
      field.visitFields(FieldWriter{child});
      node[name] = child;
    } else {
      node[name] = field;
    }
  }
};

}  // namespace internal

/// Overrides the fields of an options struct by the keys of a YAML map; fields without a key keep their
/// value. The same function serves a YAML file and, through vcharge_ros, the parameter server. `source` names
/// the file or namespace in errors. Throws InputError for unknown keys, values of a wrong type, and what
/// validate() rejects; `options` is then unchanged.
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

/// readFields from a file. InputError when the file cannot be read or is no YAML.
YAML::Node loadYamlFile(const std::string& path);
template <class Options>
void readFieldsFromFile(const std::string& path, Options* options) {
  readFields(loadYamlFile(path), path, options);
}

/// All fields with their values, as a YAML map: for provenance and for showing the defaults.
template <class Options>
YAML::Node writeFields(const Options& options) {
  YAML::Node node(YAML::NodeType::Map);
  Options copy = options;
  copy.visitFields(internal::FieldWriter{node});
  return node;
}

/// std::invalid_argument "<field>: <requirement>, is <value>" unless the condition holds; for validate().
void requireField(bool condition, const char* field, const char* requirement, double value);

/// validate() of an options struct inside another; errors name "<field>.<inner field>".
template <class Options>
void validateInner(const char* field, const Options& options) {
  try {
    options.validate();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(field) + "." + error.what());
  }
}

}  // namespace vcharge
