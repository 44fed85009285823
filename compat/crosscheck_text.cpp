// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "crosscheck_text.h"

#include <cmath>
#include <cstdio>
#include <vector>

#include "../translation/oracle/tolerances.h"

BTGPU_TRANSLATION_BEGIN
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return text;
}

std::string bodiesOf(const btGpuCheck& check) {
  if (check.m_indexA < 0) return "no body that is still in the world";
  if (check.m_indexB < 0) return "body " + std::to_string(check.m_indexA);
  return "bodies " + std::to_string(check.m_indexA) + " and " + std::to_string(check.m_indexB);
}

std::string exceeded(const btGpuCheck& check) {
  return std::string(check.m_name) + " " + number(check.m_value) + " > " + number(check.m_limit);
}

// Names and numbers only: nothing that JSON would have to escape.
std::string quoted(const std::string& text) { return '"' + text + '"'; }
std::string member(const char* name, const std::string& value) { return quoted(name) + ":" + value; }
// JSON has no NaN and no infinity.
std::string member(const char* name, double value) {
  return member(name, std::isfinite(value) ? number(value) : std::string("null"));
}
std::string member(const char* name, unsigned long long value) { return member(name, std::to_string(value)); }
std::string member(const char* name, bool value) { return member(name, std::string(value ? "true" : "false")); }
std::string index(const char* name, const btCollisionObject* object) {
  return member(name, object ? std::to_string(object->getWorldArrayIndex()) : std::string("null"));
}

std::string joined(const std::vector<std::string>& parts, char open, char close) {
  std::string text(1, open);
  for (const std::string& part : parts) {
    if (text.size() > 1) text += ',';
    text += part;
  }
  return text + close;
}
std::string object(const std::vector<std::string>& members) { return joined(members, '{', '}'); }

std::string checkJson(const btGpuCheck& check, bool ofStep) {
  std::vector<std::string> members = {member("name", quoted(check.m_name)), member("value", check.m_value),
                                      member("limit", check.m_limit), member("failed", check.m_failed)};
  if (ofStep && check.m_indexA >= 0) {
    members.push_back(member("a", std::to_string(check.m_indexA)));
    if (check.m_indexB >= 0) members.push_back(member("b", std::to_string(check.m_indexB)));
    members.push_back(member("difference", check.m_difference));
  }
  return object(members);
}

std::string checksJson(const std::vector<btGpuCheck>& checks, bool ofStep) {
  std::vector<std::string> list;
  for (const btGpuCheck& check : checks) list.push_back(checkJson(check, ofStep));
  return joined(list, '[', ']');
}

std::string listJson(const std::vector<std::string>& texts) {
  std::vector<std::string> list;
  for (const std::string& text : texts) list.push_back(quoted(text));
  return joined(list, '[', ']');
}

}  // namespace

std::string crosscheckText(int world, const btGpuCrosscheckStep& failed) {
  std::string text =
      "btgpu: cross-check of world " + std::to_string(world) + ", step " + std::to_string(failed.m_step) + ", failed";
  for (const btGpuCheck& check : failed.m_checks) {
    if (!check.m_failed) continue;
    text += "; " + exceeded(check) + " (" + tolerance(check.m_name).meaning + "), most in " + bodiesOf(check) + ": " +
            number(check.m_difference);
  }
  return text;
}

std::string crosscheckText(int world, const btGpuCrosscheckSummary& s) {
  std::string text = "btgpu: cross-check of world " + std::to_string(world) + ": " + std::to_string(s.m_checkedSteps) +
                     " of " + std::to_string(s.m_steps) + " steps compared with stock";
  if (s.m_partlySteps > 0) text += ", " + std::to_string(s.m_partlySteps) + " of them in part";
  if (s.m_stockSteps > 0) text += ", " + std::to_string(s.m_stockSteps) + " ran on the stock path";
  if (s.m_checkedSteps == 0) return text + ": nothing was checked";
  text += ", " + std::to_string(s.m_failedSteps) + " failed";
  std::string failed;
  for (const btGpuCheck& check : s.m_checks) {
    if (check.m_failed) failed += (failed.empty() ? "" : ", ") + exceeded(check);
  }
  if (!s.m_error.empty()) text += ", then the check ended: " + s.m_error;
  text += failed.empty() ? "; the whole run is in agreement" : "; the whole run is NOT in agreement: " + failed;
  return text + " (" + number(s.m_milliseconds / static_cast<double>(s.m_checkedSteps)) + " ms a check)";
}

std::string crosscheckJson(int world, const btGpuCrosscheckStep& s) {
  std::vector<std::string> members = {member("world", std::to_string(world)), member("step", s.m_step),
                                      member("failed", s.failed()), member("unchecked", listJson(s.m_unchecked)),
                                      member("checks", checksJson(s.m_checks, true))};
  if (s.m_body) {
    members.push_back(member("body", object({index("index", s.m_body), member("kind", quoted(s.m_bodyKind)),
                                             member("difference", s.m_bodyDifference)})));
  }
  if (s.m_joint) {
    members.push_back(
        member("joint", object({index("a", &s.m_joint->getRigidBodyA()), index("b", &s.m_joint->getRigidBodyB()),
                                member("ours", s.m_jointError), member("stock", s.m_jointStockError)})));
  }
  if (s.m_contactA && s.m_contactB) {
    members.push_back(member("contact", object({index("a", s.m_contactA), index("b", s.m_contactB),
                                                member("difference", s.m_contactDifference)})));
  }
  members.push_back(member("ms", s.m_milliseconds));
  return object(members) + "\n";
}

std::string crosscheckJson(int world, const btGpuCrosscheckSummary& s) {
  return object({member("world", std::to_string(world)), member("steps", s.m_steps),
                 member("checkedSteps", s.m_checkedSteps), member("partlySteps", s.m_partlySteps),
                 member("stockSteps", s.m_stockSteps), member("failedSteps", s.m_failedSteps),
                 member("agreed", s.agreed()), member("firstFailed", s.m_first.m_step),
                 member("checks", checksJson(s.m_checks, false)), member("ms", s.m_milliseconds)}) +
         "\n";
}

BTGPU_TRANSLATION_END
