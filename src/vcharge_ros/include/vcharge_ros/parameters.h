#pragma once

#include <string>

#include <ros/node_handle.h>
#include <xmlrpcpp/XmlRpcValue.h>
#include <yaml-cpp/yaml.h>

#include "vcharge_core/base/options.h"

namespace vcharge {

/// Converts a parameter to YAML with exact numbers. InputError "<source>: ..." for types without YAML form
/// (dates, binary).
YAML::Node toYaml(const XmlRpc::XmlRpcValue& value, const std::string& source);

/// Reads the parameter; returns an empty map if it is not set.
YAML::Node readParameter(const ros::NodeHandle& node, const std::string& key);

/// readFields (vcharge_core/options.h) from the parameter server: overrides the fields of `options` by the
/// parameters under `key`. InputError names the parameter.
template <class Options>
void readFieldsFromParameters(const ros::NodeHandle& node, const std::string& key, Options* options) {
  readFields(readParameter(node, key), "parameter " + node.resolveName(key), options);
}

/// Reads a required parameter. InputError names it and its purpose `what` ("the path of a rig.yaml").
std::string requireStringParameter(const ros::NodeHandle& node, const std::string& key,
                                   const std::string& what);

}  // namespace vcharge
