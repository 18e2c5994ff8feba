#pragma once
#include <gtest/gtest.h>

#include <stdexcept>

#include "relax/homogenize.hpp"
#include "scenes/own_folder.hpp"

/// Tests that CalculiX solves for, skipped where it is not installed.
class WithCalculix : public OwnFolder {
 protected:
  void SetUp() override {
    OwnFolder::SetUp();
    try {
      relax::find_ccx("ccx");
    } catch (const std::runtime_error& e) {
      GTEST_SKIP() << e.what();
    }
  }
};
