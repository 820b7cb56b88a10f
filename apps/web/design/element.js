/** An element with members and children. */
export const element = (name, {role, ...members} = {}, ...children) => {
  const made = Object.assign(document.createElement(name), members);
  if (role) made.setAttribute('role', role);
  made.append(...children);
  return made;
};
