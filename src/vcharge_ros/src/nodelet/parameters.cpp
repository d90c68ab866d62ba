#include "vcharge_ros/parameters.h"

#include <cmath>
#include <cstdio>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// yaml-cpp writes doubles with its own precision, and cannot write "inf".
YAML::Node scalarFromDouble(double value) {
  if (std::isnan(value)) {
    return YAML::Node(".nan");
  }
  if (std::isinf(value)) {
    return YAML::Node(value > 0.0 ? ".inf" : "-.inf");
  }
  char text[32];
  std::snprintf(text, sizeof(text), "%.17g", value);
  return YAML::Node(text);
}

}  // namespace

YAML::Node toYaml(const XmlRpc::XmlRpcValue& value, const std::string& source) {
  XmlRpc::XmlRpcValue copy = value;  // its conversions are not const
  switch (copy.getType()) {
    case XmlRpc::XmlRpcValue::TypeBoolean:
      return YAML::Node(static_cast<bool>(copy));
    case XmlRpc::XmlRpcValue::TypeInt:
      return YAML::Node(static_cast<int>(copy));
    case XmlRpc::XmlRpcValue::TypeDouble:
      return scalarFromDouble(static_cast<double>(copy));
    case XmlRpc::XmlRpcValue::TypeString:
      return YAML::Node(static_cast<std::string>(copy));
    case XmlRpc::XmlRpcValue::TypeArray: {
      YAML::Node list(YAML::NodeType::Sequence);
      for (int i = 0; i < copy.size(); ++i) {
        list.push_back(toYaml(copy[i], source + "[" + std::to_string(i) + "]"));
      }
      return list;
    }
    case XmlRpc::XmlRpcValue::TypeStruct: {
      YAML::Node map(YAML::NodeType::Map);
      for (auto& entry : copy) {
        map[entry.first] = toYaml(entry.second, source + "/" + entry.first);
      }
      return map;
    }
    default:
      throw InputError(source + ": expected a number, boolean, text, list or map");
  }
}

YAML::Node readParameter(const ros::NodeHandle& node, const std::string& key) {
  XmlRpc::XmlRpcValue value;
  if (!node.getParam(key, value)) {
    return YAML::Node(YAML::NodeType::Map);
  }
  return toYaml(value, "parameter " + node.resolveName(key));
}

std::string requireStringParameter(const ros::NodeHandle& node, const std::string& key,
                                   const std::string& what) {
  XmlRpc::XmlRpcValue value;
  const std::string name = "parameter " + node.resolveName(key);
  if (!node.getParam(key, value)) {
    throw InputError(name + ": is missing; expected " + what);
  }
  if (value.getType() != XmlRpc::XmlRpcValue::TypeString || static_cast<std::string>(value).empty()) {
    throw InputError(name + ": expected " + what);
  }
  return static_cast<std::string>(value);
}

}  // namespace vcharge
