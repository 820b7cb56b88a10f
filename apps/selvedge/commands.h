// What the verbs of selvedge do, one source file per verb or pair of verbs. Reports go to standard output,
// errors and progress to standard error. Each returns the exit status: 0 good, 1 bad input, 2 usage.
#pragma once

#include "apps/selvedge/command_line.h"

namespace selvedge {

int run(const StitchCommand& command);
int run(const BakeCommand& command);
int run(const MergeCommand& command);
int run(const FitCommand& command);
int run(const MakeCommand& command);
int run(const DressCommand& command);
int run(const ReattachCommand& command);
int run(const CheckCommand& command);
int run(const InfoCommand& command);
int run(const EvaluateCommand& command);
int run(const AnswerCommand& command);
int run(const RepackCommand& command);
int run(const CompareCommand& command);
int run(const SwatchCommand& command);
int run(const TradeCommand& command);
int run(const PlanCommand& command);

}  // namespace selvedge
