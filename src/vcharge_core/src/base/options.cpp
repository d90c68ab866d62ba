#include "vcharge_core/base/options.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <sstream>

#include "vcharge_core/files/file_io.h"

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

std::string valueText(double value) {
  for (int digits = 6; digits < 17; ++digits) {
    std::ostringstream text;
    text << std::setprecision(digits) << value;
    if (std::strtod(text.str().c_str(), nullptr) == value) {
      return std::isinf(value) ? (value > 0.0 ? ".inf" : "-.inf") : text.str();
    }
  }
  std::ostringstream text;
  text << std::setprecision(17) << value;
  return text.str();
}

std::string valueText(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) {
    texts.push_back(valueText(value));
  }
  return "[" + join(texts) + "]";
}

std::string valueText(const std::string& value) {
  return oneLine(YAML::Node(value));
}

std::string valueText(const std::vector<std::string>& values) {
  return oneLine(YAML::Node(values));
}

std::string describeChoices(const std::vector<std::string>& names) {
  return "one of " + join(names);
}

void checkValue(const OptionDeclaration& option, double value) {
  requireField(option.range.contains(value), option.name, option.range.requirement().c_str(), value);
}

void checkValue(const OptionDeclaration& option, const std::vector<double>& values) {
  for (const double value : values) {
    checkValue(option, value);
  }
}

std::string showRows(const std::vector<OptionRow>& rows) {
  std::string text;
  for (const OptionRow& row : rows) {
    const auto depth = static_cast<size_t>(std::count(row.key.begin(), row.key.end(), '.'));
    const size_t dot = row.key.rfind('.');
    text +=
        std::string(2 * depth, ' ') + (dot == std::string::npos ? row.key : row.key.substr(dot + 1)) + ":";
    text += !row.group_type.empty() ? "" : " " + row.value;
    text += row.meaning.empty() && row.allowed.empty() ? "" : "  # " + row.meaning;
    text += (row.allowed.empty() ? "" : " (" + row.allowed + ")") + "\n";
  }
  return text;
}

/// "must be positive" -> ">0", "must be in [0, 1)" -> "[0,1)", "one of a, b" -> "a, b"
std::string shortRange(const std::string& requirement) {
  static const std::vector<std::pair<std::string, std::string>> kShort = {
      {"must not be negative", "≥0"}, {"must be positive", ">0"}, {"must be negative", "<0"},
      {"must be at least ", "≥"},     {"must be above ", ">"},    {"must be at most ", "≤"},
      {"must be below ", "<"},        {"must be in ", ""},        {"one of ", ""}};
  for (const auto& [words, symbol] : kShort) {
    if (requirement.compare(0, words.size(), words) == 0) {
      std::string text = symbol + requirement.substr(words.size());
      text.erase(std::remove(text.begin(), text.end(), ' '), text.end());
      return text;
    }
  }
  return requirement;
}

std::string listRows(const std::vector<OptionRow>& rows, std::map<std::string, std::string>* listed_groups,
                     const std::string& section) {
  std::string text = "|option|default|range|meaning|\n|---|---|---|---|\n";
  std::string skipped = "\n";  // prefix of the keys of a group that is not listed again
  for (const OptionRow& row : rows) {
    if (row.key.compare(0, skipped.size(), skipped) == 0) {
      continue;
    }
    if (row.group_type.empty()) {
      text += "|" + row.key + "|`" + row.value + "`|" + shortRange(row.allowed) + "|" + row.meaning + "|\n";
      continue;
    }
    const auto [listed, is_new] = listed_groups->emplace(row.group_type, section + ": " + row.key);
    text += "|**" + row.key + "**||" + (is_new ? "" : "see " + listed->second) + "|" + row.meaning + "|\n";
    skipped = is_new ? "\n" : row.key + ".";
  }
  return text;
}

}  // namespace internal

bool OptionRange::contains(double value) const {
  return (includes_min ? value >= min : value > min) && (includes_max ? value <= max : value < max);
}

std::string OptionRange::requirement() const {
  const bool has_min = std::isfinite(min), has_max = std::isfinite(max);
  std::ostringstream text;
  if (has_min && has_max) {
    text << "must be in " << (includes_min ? '[' : '(') << min << ", " << max << (includes_max ? ']' : ')');
  } else if (has_min) {
    if (min == 0.0) {
      return includes_min ? "must not be negative" : "must be positive";
    }
    text << "must be " << (includes_min ? "at least " : "above ") << min;
  } else if (has_max) {
    if (max == 0.0 && !includes_max) {
      return "must be negative";
    }
    text << "must be " << (includes_max ? "at most " : "below ") << max;
  }
  return text.str();
}

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
