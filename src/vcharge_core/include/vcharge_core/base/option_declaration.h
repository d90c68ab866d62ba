#pragma once

#include <limits>
#include <string>
#include <type_traits>
#include <utility>

namespace vcharge {

/// Allowed values of a numeric option. Built by the functions below, for example `above(0.0).upTo(1.0)`.
struct OptionRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool includes_min = true;
  bool includes_max = true;

  constexpr OptionRange upTo(double value) const { return {min, value, includes_min, true}; }
  constexpr OptionRange below(double value) const { return {min, value, includes_min, false}; }
  /// Always false for NaN.
  bool contains(double value) const;
  /// For example "must be positive" or "must be in (0, 1]"; empty if every value is allowed.
  std::string requirement() const;
};

constexpr OptionRange anyValue() {
  return {};
}
constexpr OptionRange atLeast(double value) {
  return OptionRange{value};
}
constexpr OptionRange above(double value) {
  return {value, std::numeric_limits<double>::infinity(), false, true};
}
constexpr OptionRange positive() {
  return above(0.0);
}
constexpr OptionRange notNegative() {
  return atLeast(0.0);
}
constexpr OptionRange between(double min, double max) {
  return atLeast(min).upTo(max);
}

/// Declaration of an option: everything except its type and default.
struct OptionDeclaration {
  const char* name;
  OptionRange range;
  const char* meaning;  ///< one sentence
};

namespace internal {

template <int number>
using SourceLine = std::integral_constant<int, number>;

template <class Options, int number, class = void>
struct HasOptionAt : std::false_type {};
template <class Options, int number>
struct HasOptionAt<Options, number,
                   std::void_t<decltype(Options::markOption(std::declval<SourceLine<number>>()))>>
    : std::true_type {};

template <class Options, int first, int... offsets, class Self, class Visitor>
void visitLines(Self& self, Visitor& visit, std::integer_sequence<int, offsets...> /*lines*/) {
  const auto visitLine = [&](auto line) {
    if constexpr (HasOptionAt<Options, decltype(line)::value>::value) {
      Options::visitOption(line, self, visit);
    }
  };
  (visitLine(SourceLine<first + offsets>()), ...);
}

}  // namespace internal

/// An options struct declares each option once, between two macros:
///
///   struct PlaneSweepOptions {
///     VCHARGE_BEGIN_OPTIONS(PlaneSweepOptions);
///     VCHARGE_OPTION(double, min_distance_m, 0.3, positive(), "Distance of the nearest plane.");
///     VCHARGE_OPTION(int, num_planes, 64, between(2, 256), "Planes, uniform in inverse distance.");
///     VCHARGE_OPTION_GROUP(SmoothingOptions, smoothing, {}, "Smoothing of the costs.");
///     VCHARGE_END_OPTIONS();
///   };
///
/// The fields are plain members. validate() throws std::invalid_argument that names the field and what is
/// required of it; a struct whose fields depend on each other also has `void checkFields() const`, which
/// validate() calls last. Each option is declared on one line of the source.
#define VCHARGE_BEGIN_OPTIONS(Struct)                                \
  using OptionsStruct = Struct;                                      \
  void validate() const {                                            \
    ::vcharge::validateOptions(*this);                               \
  }                                                                  \
  template <class Self, class Visitor>                               \
  static void visitInherited(Self& /*self*/, Visitor&& /*visit*/) {} \
  static constexpr int kFirstOptionLine = __LINE__

/// The same for a struct that inherits the options of `Base` and lists them before its own.
#define VCHARGE_BEGIN_DERIVED_OPTIONS(Struct, Base)         \
  using OptionsStruct = Struct;                             \
  void validate() const {                                   \
    ::vcharge::validateOptions(*this);                      \
  }                                                         \
  template <class Self, class Visitor>                      \
  static void visitInherited(Self& self, Visitor&& visit) { \
    Base::visitOptions(self, visit);                        \
  }                                                         \
  static constexpr int kFirstOptionLine = __LINE__

#define VCHARGE_OPTION(type, name, default_value, range, meaning)                                   \
  static void markOption(::vcharge::internal::SourceLine<__LINE__>);                                \
  template <class Self, class Visitor>                                                              \
  static void visitOption(::vcharge::internal::SourceLine<__LINE__>, Self& self, Visitor&& visit) { \
    visit(::vcharge::OptionDeclaration{#name, range, meaning}, self.name);                          \
  }                                                                                                 \
  type name = default_value

/// A nested options struct; a map in YAML.
#define VCHARGE_OPTION_GROUP(type, name, default_value, meaning) \
  VCHARGE_OPTION(type, name, default_value, ::vcharge::anyValue(), meaning)

#define VCHARGE_END_OPTIONS()                                                         \
  template <class Self, class Visitor>                                                \
  static void visitOptions(Self& self, Visitor&& visit) {                             \
    visitInherited(self, visit);                                                      \
    ::vcharge::internal::visitLines<OptionsStruct, kFirstOptionLine>(                 \
        self, visit, std::make_integer_sequence<int, __LINE__ - kFirstOptionLine>()); \
  }                                                                                   \
  static_assert(true)

}  // namespace vcharge
