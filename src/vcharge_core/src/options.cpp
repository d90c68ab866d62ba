#include "vcharge_core/options.h"

#include <algorithm>
#include <sstream>

#include "vcharge_core/file_io.h"

namespace vcharge {
namespace internal {
namespace {

std::string oneLine(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter << YAML::Flow << node;
  std::string text = emitter.c_str() != nullptr ? emitter.c_str() : "";
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.size() > 80 ? text.substr(0, 77) + "..." : text;
}

std::string join(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + name;
  }
  return text;
}

template <class T>
void readScalarOrList(const YAML::Node& node, const std::string& source, const std::string& key,
                      const std::string& expected, T* value) {
  try {
    *value = node.as<T>();
  } catch (const YAML::Exception&) {
    throwBadField(source, key, expected, node);
  }
}

}  // namespace

void throwBadField(const std::string& source, const std::string& key, const std::string& expected,
                   const YAML::Node& node) {
  throw InputError(source + ": " + key + ": expected " + expected + ", got '" + oneLine(node) + "'");
}

void checkKeys(const YAML::Node& node, const std::string& source, const std::string& prefix,
               const std::vector<std::string>& known) {
  if (!node.IsDefined() || node.IsNull()) {
    return;
  }
  if (!node.IsMap()) {
    throwBadField(source, prefix.empty() ? "(top level)" : prefix, "a map of " + join(known), node);
  }
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) {
      throwBadField(source, prefix.empty() ? "(top level)" : prefix, "a text as a key", entry.first);
    }
    const std::string key = entry.first.Scalar();
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      throw InputError(source + ": " + (prefix.empty() ? "" : prefix + ".") + key +
                       ": unknown key, expected one of " + join(known));
    }
  }
}

void readValue(const YAML::Node& node, const std::string& source, const std::string& key, bool* value) {
  readScalarOrList(node, source, key, "true or false", value);
}
void readValue(const YAML::Node& node, const std::string& source, const std::string& key, int* value) {
  readScalarOrList(node, source, key, "a whole number", value);
}
void readValue(const YAML::Node& node, const std::string& source, const std::string& key, double* value) {
  readScalarOrList(node, source, key, "a number", value);
}
void readValue(const YAML::Node& node, const std::string& source, const std::string& key,
               std::string* value) {
  readScalarOrList(node, source, key, "a text", value);
}
void readValue(const YAML::Node& node, const std::string& source, const std::string& key,
               std::vector<double>* value) {
  readScalarOrList(node, source, key, "a list of numbers", value);
}
void readValue(const YAML::Node& node, const std::string& source, const std::string& key,
               std::vector<std::string>* value) {
  readScalarOrList(node, source, key, "a list of texts", value);
}

int readEnum(const YAML::Node& node, const std::string& source, const std::string& key,
             const std::vector<std::string>& names) {
  const std::string text = node.IsScalar() ? node.Scalar() : std::string();
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) {
    throwBadField(source, key, "one of " + join(names), node);
  }
  return static_cast<int>(found - names.begin());
}

}  // namespace internal

YAML::Node loadYamlFile(const std::string& path) {
  const std::string text = readTextFile(path);
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(path + ": line " + std::to_string(error.mark.line + 1) +
                     ": not valid YAML: " + error.msg);
  }
}

void requireField(bool condition, const char* field, const char* requirement, double value) {
  if (!condition) {
    std::ostringstream text;
    text << field << ": " << requirement << ", is " << value;
    throw std::invalid_argument(text.str());
  }
}

}  // namespace vcharge
