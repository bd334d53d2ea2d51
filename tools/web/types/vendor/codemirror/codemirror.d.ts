// The types of service/web/vendor/codemirror, from the packages that it is built of.

export * from "../../../codemirror.js";
