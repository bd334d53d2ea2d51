// The types of service/web/vendor/codemirror, from the packages that it is built of.

export * from "../../../codemirror.js";
export type { Completion, CompletionContext, CompletionResult } from "@codemirror/autocomplete";
export type { ChangeDesc, Line, StateEffectType, Text } from "@codemirror/state";
export type { DecorationSet, Tooltip } from "@codemirror/view";
export type { SyntaxNode } from "@lezer/common";
