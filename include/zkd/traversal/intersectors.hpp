// SPDX-License-Identifier: Apache-2.0
//
// Which code an Intersector stands for, where host and device have it. For device code and the
// library: see arithmetic.hpp.
#pragma once

#include <zkd/query.hpp>
#include <zkd/traversal/intersect.hpp>
#include <zkd/traversal/single.hpp>

namespace zkd::core {

template <Intersector>
struct Named;
template <>
struct Named<Intersector::watertight> {
  using type = Watertight;
};
template <>
struct Named<Intersector::fast> {
  using type = Fast;
};
template <>
struct Named<Intersector::single_precision> {
  using type = SinglePrecision;
};
template <>
struct Named<Intersector::double_precision> {
  using type = DoublePrecision;
};

/// call<type of the intersector>(), for all but `exact`.
template <class Call>
auto with_intersector(Intersector intersector, Call call) {
  switch (intersector) {
    case Intersector::fast:
      return call.template operator()<Fast>();
    case Intersector::single_precision:
      return call.template operator()<SinglePrecision>();
    case Intersector::double_precision:
      return call.template operator()<DoublePrecision>();
    default:
      return call.template operator()<Watertight>();
  }
}

}  // namespace zkd::core
